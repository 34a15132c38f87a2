"""The leg to be simulated: one kind of run of an identified model, laid out for the compiled
dynamics."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from pipelines.contracts import PARAMETERS, Joint, joints_of
from pipelines.contracts.table import Table
from pipelines.dynamics.assembly import Assembly, assemble
from pipelines.dynamics.mobility import masses
from pipelines.effects.rigid_body import RigidBody
from pipelines.errors import InputError
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.machine import Machine, machine_of
from pipelines.mechanics.mechanisms.leg import LEG
from pipelines.mechanics.motion import geometry_of
from pipelines.model import Model, model_from_parameters
from pipelines.model.per_run import with_own_values


@dataclass(frozen=True)
class Plant:
    """A model that can move."""

    model: Model
    geometry: Geometry
    joints: tuple[Joint, ...]
    run: str
    assembly: Assembly
    guesses: tuple[str, ...] = ()
    """What each run has for itself, and nobody knows of this one."""

    @property
    def machine(self) -> Machine:
        """The machine it is a model of."""
        return machine_of(self.joints, self.geometry)

    def metadata(self) -> dict:
        """Return what a file says of the plant: run, geometry and every parameter of every
        effect."""
        effects = [
            {
                "effect": term.effect.label,
                **{
                    p.name: float(v)
                    for p, v in zip(
                        term.effect.parameters, term.effect.physical(term.values), strict=True
                    )
                },
            }
            for term in self.model
        ]
        return {
            "run": self.run,
            "geometry": self.machine.metadata(self.geometry),
            "effects": effects,
        }


def make_plant(model: Model, geometry: Geometry, joints: tuple[Joint, ...], run: str) -> Plant:
    """Return the plant of a kind of run, or refuse a machine that cannot exist."""
    model = model.for_run(run)
    assembly = assemble(model, geometry, [joint.name for joint in joints])
    lightest = _lightest(assembly)
    if lightest <= 0:
        X = sum(term.values for term in model if isinstance(term.effect, RigidBody))
        mechanism = machine_of(joints, geometry).mechanism
        reasons = mechanism.unrealizable(X, geometry) or [
            f"the mass matrix has the eigenvalue {lightest:.3g} kg·m²"
        ]
        whose, mend = (
            ("leg", "from motions that separate X1, X2 and X3 better")
            if mechanism is LEG
            else (
                "machine",
                "from richer motions, with the signs of torque and angle as they should be",
            )
        )
        raise InputError(
            f"the {run} parameters are no real {whose}: {'; '.join(reasons)}. A simulation of it"
            f" would run away; identify again {mend}, or choose another --run"
        )
    return Plant(model, geometry, joints, run, assembly)


def _lightest(assembly: Assembly) -> float:
    """Return the least eigenvalue of the mass matrix at any pose, kg·m²; 0 where there is no mass
    to divide by."""
    try:
        return float(np.linalg.eigvalsh(masses(assembly)[0]).min())
    except ZeroDivisionError:
        return 0.0


def plant_from_table(
    table: Table, run: str, default_geometry: Geometry | None = None, recording: Path | None = None
) -> Plant:
    """Return the plant that a ``parameters/1`` table describes for one kind of run, as it was in a
    recorded one.

    Raises
    ------
    InputError
        Where it holds no model of that run.
    """
    bodies = table.frame.loc[table.frame["effect"] == "rigid_body", "run"]
    if not (bodies.isna() | (bodies == run)).any():
        known = ", ".join(sorted(set(bodies) - {"human"})) or "none"
        raise InputError(
            f"{table.path}: holds no model of the run {run}, only of: {known}; choose one with"
            " --run"
        )
    joints, geometry = joints_of(table.metadata), geometry_of(table.metadata, default_geometry)
    machine = machine_of(joints, geometry, table.path)
    model, guesses = with_own_values(
        model_from_parameters(table.frame, run, machine).for_run(run), table, recording
    )
    return replace(make_plant(model, geometry, joints, run), guesses=guesses)


def read_plant(path: Path | str, run: str, default_geometry: Geometry | None = None) -> Plant:
    """Return the plant in a ``parameters/1`` file."""
    return plant_from_table(PARAMETERS.read(path), run, default_geometry)

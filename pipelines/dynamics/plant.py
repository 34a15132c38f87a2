"""The leg to be simulated: one kind of run of an identified model, compiled."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from pipelines.contracts import Joint, joints_of
from pipelines.contracts.table import Table
from pipelines.dynamics.assembly import Assembly, assemble
from pipelines.dynamics.mobility import masses
from pipelines.effects.baseline import RigidBody
from pipelines.errors import InputError
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.machine import Machine, machine_of
from pipelines.mechanics.mechanisms.leg import LEG
from pipelines.mechanics.motion import geometry_of
from pipelines.model import Model, model_from_parameters
from pipelines.model.per_run import with_own_values


@dataclass(frozen=True)
class Plant:
    """A model that can be simulated."""

    model: Model
    geometry: Geometry
    joints: tuple[Joint, ...]
    run: str
    assembly: Assembly
    guesses: tuple[str, ...] = ()
    """Remarks on values that differ from run to run, and are unknown for this one."""

    @property
    def machine(self) -> Machine:
        """Machine of the model."""
        return machine_of(self.joints, self.geometry)

    def metadata(self) -> dict:
        """Return run, geometry and the parameters of every effect, for a file's metadata."""
        effects = []
        for term in self.model:
            physical = term.effect.physical(term.values)
            named = zip(term.effect.parameters, physical, strict=True)
            effects.append({"effect": term.effect.label} | {p.name: float(v) for p, v in named})
        geometry = self.machine.metadata(self.geometry)
        return {"run": self.run, "geometry": geometry, "effects": effects}


def make_plant(model: Model, geometry: Geometry, joints: tuple[Joint, ...], run: str) -> Plant:
    """Return the plant of a kind of run.

    Raises
    ------
    InputError
        If no real machine has its parameters, or a torque was not measured.
    """
    machine = machine_of(joints, geometry)
    machine.refuse_unmeasured("the model", "A simulation")
    model = model.for_run(run)
    assembly = assemble(model, geometry, [joint.name for joint in joints])
    lightest = _lightest(assembly)
    if lightest <= 0:
        X = sum(term.values for term in model if isinstance(term.effect, RigidBody))
        reasons = machine.mechanism.unrealizable(X, geometry) or [
            f"the mass matrix has the eigenvalue {lightest:.3g} kg·m²"
        ]
        whose, remedy = "leg", "from motions that separate X1, X2 and X3 better"
        if machine.mechanism is not LEG:
            whose = "machine"
            remedy = "from richer motions, with the signs of torque and angle as they should be"
        raise InputError(
            f"the {run} parameters are not those of a real {whose}: {'; '.join(reasons)}. Its"
            f" simulation diverges; identify again {remedy}, or choose another --run"
        )
    return Plant(model, geometry, joints, run, assembly)


def _lightest(assembly: Assembly) -> float:
    """Return the least eigenvalue of the mass matrix at any pose, kg·m²; 0 if it is singular."""
    try:
        return float(np.linalg.eigvalsh(masses(assembly)[0]).min())
    except ZeroDivisionError:
        # Compiled code divides by the determinant, which is zero without mass.
        return 0.0


def plant_from_table(
    table: Table, run: str, default_geometry: Geometry | None = None, recording: Path | None = None
) -> Plant:
    """Return the plant in a ``parameters/1`` table for one kind of run.

    Parameters
    ----------
    table : Table
        The ``parameters/1`` table.
    run : str
        Kind of run.
    default_geometry : Geometry, optional
        Geometry, if the table has none.
    recording : Path, optional
        Recording whose own values the plant has.

    Raises
    ------
    InputError
        If the table has no model of that run.
    """
    bodies = table.frame.loc[table.frame["effect"] == RigidBody.name, "run"]
    if not (bodies.isna() | (bodies == run)).any():
        known = ", ".join(sorted(set(bodies) - {"human"})) or "none"
        raise InputError(
            f"{table.path}: holds no model of the run {run}, only of: {known}; choose one with"
            " --run"
        )
    joints, geometry = joints_of(table.metadata), geometry_of(table.metadata, default_geometry)
    machine = machine_of(joints, geometry, table.path)
    machine.refuse_unmeasured(table.path, "A simulation")
    model, guesses = with_own_values(
        model_from_parameters(table.frame, run, machine).for_run(run), table, recording
    )
    return replace(make_plant(model, geometry, joints, run), guesses=guesses)

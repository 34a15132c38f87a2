"""The model to export: one kind of run of an identified model, with its origin."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipelines import __version__
from pipelines.contracts import Joint, joints_of
from pipelines.contracts.provenance import sha256
from pipelines.contracts.table import Table
from pipelines.dynamics.assembly import cuffed
from pipelines.dynamics.plant import make_plant
from pipelines.effects import Element, Side
from pipelines.effects.baseline import Friction, RigidBody
from pipelines.errors import InputError, about
from pipelines.export.format import Degree, Format, Holding, left_out
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.machine import Machine, machine_of
from pipelines.mechanics.motion import geometry_of
from pipelines.model import Model, Term, model_from_parameters


@dataclass(frozen=True)
class ExportedModel:
    """A model to export, with all values."""

    model: Model
    """The terms that act in the run."""
    absent: tuple[tuple[Term, Holding], ...]
    """Terms of the file that do not act in the run, and why."""
    run: str
    """``exo_alone``, ``with_human``, or ``human`` for the wearer alone."""
    geometry: Geometry
    machine: Machine
    table: Table
    """The ``parameters/1`` table of the model."""

    @property
    def joints(self) -> tuple[Joint, ...]:
        """The machine's joints, from the base on."""
        return self.machine.joints

    @property
    def terms(self) -> tuple[Term, ...]:
        """The model's terms, with bodies that move together added up."""
        bodies = [term for term in self.model if isinstance(term.effect, RigidBody)]
        # Torque is linear in inertial parameters, so those of machine and limb add up.
        body = replace(bodies[0], values=np.sum([term.values for term in bodies], axis=0))
        return (body, *(term for term in self.model if not isinstance(term.effect, RigidBody)))

    @property
    def X(self) -> NDArray:
        """Inertial parameters of all that moves, (p,) in the mechanism's order and units."""
        return self.terms[0].values

    def of(self, element: Element, joint: str) -> Term | None:
        """Return the term at a joint that is a simulator's element, if the model has it."""
        for term in self.terms:
            if term.effect.element is element and term.effect.joint == joint:
                return term
        return None

    def holdings(self, format: Format[Any]) -> list[tuple[Term, Holding]]:
        """Return each term of the file and how the format holds it."""
        return [(term, format.holding(term)) for term in self.terms] + list(self.absent)

    def friction_warnings(self) -> list[str]:
        """Return a warning for each negative friction coefficient, which drives its joint."""
        return [
            f"{term.effect.label}: {p.name} = {value:.3g} {p.unit} is negative: it drives the"
            " joint, and a simulation may diverge. Identify again, or set it to 0"
            for term in self.terms
            if isinstance(term.effect, Friction)
            for p, value in zip(term.effect.parameters, term.values, strict=True)
            if value < 0.0
        ]

    def shift(self, side: Side | None = None) -> NDArray:
        """Return the encoders' angles less the links' angles, (J,) rad; at a prismatic joint m.

        Parameters
        ----------
        side : Side, optional
            Only the part from effects of this side.
        """
        shifts = [shift_of(term) for term in self.terms if side in (None, term.effect.side)]
        return np.sum([s for s in shifts if s is not None] + [np.zeros(len(self.joints))], axis=0)

    def heading(self, format: Format[Any]) -> Iterator[str]:
        """Yield the lines of the comment at the top of every file."""
        yield f"{format.title} of an identified machine, written by exoid {__version__}"
        if self.table.path:
            yield (
                f"from {self.table.path.name} (SHA-256 {sha256(self.table.path)[:16]}), run"
                f" {self.run}"
            )
        yield "SI units; angles as the encoders give them, torques as the drives deliver them"
        yield ""
        yield from (f"WARNING: {sentence}" for sentence in self.friction_warnings())
        for term, holding in self.holdings(format):
            yield f"{term.effect.label}: {holding.degree} ({holding.how})"
            if holding.degree is not Degree.EXACT:
                yield f"    {values_in_words(term)}"


def column_of(term: Term) -> int:
    """Return the index of a term's joint; -1 for a term of the whole machine."""
    return term.effect.on.names.index(term.effect.joint) if term.effect.joint else -1


def shift_of(term: Term) -> NDArray | None:
    """Return the constant that an effect adds to the encoders' angles.

    Parameters
    ----------
    term : Term
        Any term of J joints.

    Returns
    -------
    (J,) array or None
        rad; None if its reading is more than a shift, or it has none.
    """
    if term.effect.reading is None:
        return None
    joints, joint = len(term.effect.on.joints), column_of(term)
    shifts = []
    # A constant shift is equal at two angles; that of an eccentric encoder is not.
    for angle in (np.zeros(joints), np.ones(joints)):
        reading = angle.copy()
        term.effect.reading(reading, term.values, joint)
        shifts.append(reading - angle)
    first, second = shifts
    return first if np.allclose(first, second, rtol=0.0, atol=1e-12) else None


def values_in_words(term: Term) -> str:
    """Return a term's parameters with values and units."""
    physical = term.effect.physical(term.values)
    return ", ".join(
        f"{p.name} = {value:.9g}" + (f" {p.unit}" if p.unit != "1" else "")
        for p, value in zip(term.effect.parameters, physical, strict=True)
    )


def exported(
    table: Table, run: str | None = None, default_geometry: Geometry | None = None
) -> ExportedModel:
    """Return the model of one kind of run from a ``parameters/1`` table.

    Parameters
    ----------
    table : Table
    run : str, optional
        ``exo_alone``, ``with_human`` or ``human``; by default the only one in the table, or
        ``with_human``.
    default_geometry : Geometry, optional
        Used if the table has none.

    Raises
    ------
    InputError
        If the table has no such run, or no real machine has such parameters.
    """
    bodies = set(table.frame.loc[table.frame["effect"] == RigidBody.name, "run"].dropna())
    run = run or (bodies.copy().pop() if len(bodies) == 1 else "with_human")
    geometry = geometry_of(table.metadata, default_geometry)
    machine = machine_of(joints_of(table.metadata), geometry, table.path)
    machine.refuse_unmeasured(table.path, "An export")
    with about(table.path):
        if run not in bodies:
            raise InputError(
                f"holds no rigid body for run {run!r}, only for {', '.join(sorted(bodies))}; set"
                " --run"
            )
        whole = model_from_parameters(table.frame, run, machine)
        has_cuffs = cuffed([term.effect for term in whole])
        reasons = [_why_absent(term, run, has_cuffs) for term in whole]
        judged = list(zip(whole, reasons, strict=True))
        present = [term for term, reason in judged if not reason]
        absent = [(term, left_out(reason)) for term, reason in judged if reason]
        # Effects of the wearer act only in runs with one.
        kind = "with_human" if run == "human" else run
        acting = Model(tuple(present)).for_run(kind)
        # Rigid, as each format lists springs at a joint or leaves them out. Cuffs stay, because the
        # limb behind them has its own body.
        rigid = [term for term in acting if term.effect.spring is None or term.effect.at_cuff]
        # Refuses models that no real machine has.
        make_plant(Model(tuple(rigid)), geometry, machine.joints, kind)
    return ExportedModel(acting, tuple(absent), run, geometry, machine, table)


def _why_absent(term: Term, run: str, has_cuffs: bool) -> str:
    effect = term.effect
    if not any((effect.reaction, effect.spring, effect.reading, effect.torque_reading)):
        return "a machine of this kind cannot have it"
    if run != "human":
        acts = run in effect.acts_in and effect.run in (None, run)
        return "" if acts else f"it does not act in {run} runs"
    # With cuffs, machine and limb have a body each; without, the only body is the wearer's.
    of_wearer = effect.on_limb or (isinstance(effect, RigidBody) and not has_cuffs)
    return "" if of_wearer and not effect.at_cuff else "it is the machine's, not the wearer's"

"""What is handed over: one kind of run of an identified model, and where it came from."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipelines import __version__
from pipelines.contracts import Joint, joints_of
from pipelines.contracts.provenance import sha256
from pipelines.contracts.table import Table
from pipelines.dynamics.assembly import cuffed
from pipelines.dynamics.plant import make_plant
from pipelines.effects import Side
from pipelines.effects.friction import Friction
from pipelines.effects.rigid_body import RigidBody
from pipelines.errors import InputError, about
from pipelines.export.format import Degree, Format, Holding, left_out
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.machine import Machine, machine_of
from pipelines.mechanics.motion import geometry_of
from pipelines.model import Model, Term, model_from_parameters

HUMAN = "human"
"""The wearer alone, beside the kinds of run."""


@dataclass(frozen=True)
class Exported:
    """A model to be written, all values known."""

    model: Model
    """The terms that act in the run."""
    absent: tuple[tuple[Term, Holding], ...]
    """Terms of the file that do not, and why."""
    run: str
    """``exo_alone``, ``with_human``, or ``human`` for the wearer alone."""
    geometry: Geometry
    machine: Machine
    table: Table
    """The ``parameters/1`` table that it comes from."""

    @property
    def joints(self) -> tuple[Joint, ...]:
        """The machine's, from the base on."""
        return self.machine.joints

    @property
    def terms(self) -> tuple[Term, ...]:
        """The model's terms, bodies that move together added up."""
        bodies = [term for term in self.model if isinstance(term.effect, RigidBody)]
        body = replace(bodies[0], values=np.sum([term.values for term in bodies], axis=0))
        return (body, *(term for term in self.model if not isinstance(term.effect, RigidBody)))

    @property
    def X(self) -> NDArray:
        """Inertial parameters of all that moves, (p,) in the mechanism's order and units."""
        return self.terms[0].values

    def of(self, effect: str, joint: str) -> Term | None:
        """Return an effect's term at a joint, if the model has it."""
        return next(
            (t for t in self.terms if t.effect.name == effect and t.effect.joint == joint), None
        )

    def holdings(self, format: Format) -> list[tuple[Term, Holding]]:
        """Return what becomes of each term of the file, none passed over."""
        return [(term, format.holding(term)) for term in self.terms] + list(self.absent)

    def driving(self) -> list[str]:
        """Return which friction would drive its joint, which a simulation or a controller must not
        be given unseen."""
        return [
            f"{term.effect.label}: {p.name} = {value:.3g} {p.unit} is negative: it drives the"
            " joint, and a simulation of it may run away; identify again, or set it to 0"
            for term in self.terms
            if isinstance(term.effect, Friction)
            for p, value in zip(term.effect.parameters, term.values, strict=True)
            if value < 0.0
        ]

    def shift(self, side: Side | None = None) -> NDArray:
        """Return by how much the encoders' angles are more than the links' own, (J,) rad, at a
        prismatic joint m.

        ``side`` asks for the part of it that effects of one side make.
        """
        shifts = [shift_of(term) for term in self.terms if side in (None, term.effect.side)]
        return np.sum([s for s in shifts if s is not None] + [np.zeros(len(self.joints))], axis=0)

    def heading(self, format: Format) -> Iterator[str]:
        """Yield what every written file says of itself, line by line."""
        yield f"{format.title} of an identified machine, written by exoid {__version__}"
        if self.table.path:
            yield (
                f"from {self.table.path.name} (SHA-256 {sha256(self.table.path)[:16]}), run"
                f" {self.run}"
            )
        yield "SI units; angles as the encoders give them, torques as the drives deliver them"
        yield ""
        yield from (f"WARNING: {sentence}" for sentence in self.driving())
        for term, holding in self.holdings(format):
            yield f"{term.effect.label}: {holding.degree} ({holding.how})"
            if holding.degree is not Degree.EXACT:
                yield f"    {values_in_words(term)}"


def column_of(term: Term) -> int:
    """Return the place of a term's joint, -1 for one of the whole machine."""
    return term.effect.on.names.index(term.effect.joint) if term.effect.joint else -1


def shift_of(term: Term) -> NDArray | None:
    """Return what an effect adds to the encoders' angles, (J,) rad; None where it adds no
    constant."""
    if term.effect.reading is None:
        return None
    joints, joint = len(term.effect.on.joints), column_of(term)
    angles = (np.zeros(joints), np.ones(joints))
    read = [angle.copy() for angle in angles]
    for angle in read:
        term.effect.reading(angle, term.values, joint)
    first, second = (after - before for after, before in zip(read, angles, strict=True))
    return first if np.allclose(first, second, rtol=0.0, atol=1e-12) else None


def values_in_words(term: Term) -> str:
    """Write a term's parameters as a file names them, with units."""
    physical = term.effect.physical(term.values)
    return ", ".join(
        f"{p.name} = {value:.9g}" + (f" {p.unit}" if p.unit != "1" else "")
        for p, value in zip(term.effect.parameters, physical, strict=True)
    )


def exported(
    table: Table, run: str | None = None, default_geometry: Geometry | None = None
) -> Exported:
    """Return what a ``parameters/1`` table says of one kind of run.

    Parameters
    ----------
    table : Table
    run : str, optional
        ``exo_alone``, ``with_human`` or ``human``; unless given, the only one there is, or
        ``with_human``.
    default_geometry : Geometry, optional
        Used where the table does not say its own.

    Raises
    ------
    InputError
        Where the table has no such run, or no real machine has such parameters.
    """
    bodies = set(table.frame.loc[table.frame["effect"] == RigidBody.name, "run"].dropna())
    run = run or (bodies.copy().pop() if len(bodies) == 1 else "with_human")
    geometry = geometry_of(table.metadata, default_geometry)
    machine = machine_of(joints_of(table.metadata), geometry, table.path)
    with about(table.path):
        if run not in bodies:
            raise InputError(
                f"holds no rigid body for run {run!r}, only for {', '.join(sorted(bodies))}; set"
                " --run"
            )
        whole = model_from_parameters(table.frame, run, machine)
        present, absent = [], []
        for term in whole:
            why = _why_absent(term, run, cuffed([term.effect for term in whole]))
            (absent.append((term, left_out(why))) if why else present.append(term))
        kind = "with_human" if run == HUMAN else run
        acting = Model(tuple(present)).for_run(kind)
        make_plant(_rigid(acting), geometry, machine.joints, kind)  # which refuses what cannot be
    return Exported(acting, tuple(absent), run, geometry, machine, table)


def _rigid(model: Model) -> Model:
    """Return the model with rigid joints: what only a simulation cannot lay out is listed by each
    format, not refused.

    Cuffs stay, for behind them the limb has a body of its own.
    """
    return Model(tuple(term for term in model if term.effect.spring is None or term.effect.at_cuff))


def _why_absent(term: Term, run: str, has_cuffs: bool) -> str:
    effect = term.effect
    if not any((effect.reaction, effect.spring, effect.reading, effect.torque_reading)):
        return "a machine of this kind cannot have it"
    if run != HUMAN:
        return (
            ""
            if run in effect.acts_in and effect.run in (None, run)
            else f"it does not act in {run} runs"
        )
    # Where machine and limb move apart, each has a body; elsewhere the one there is, is the
    # wearer's.
    wearers = effect.on_limb or (isinstance(effect, RigidBody) and not has_cuffs)
    return "" if wearers and not effect.at_cuff else "it is the machine's, not the wearer's"

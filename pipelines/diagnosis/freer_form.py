"""Causes in a freer form: a spring that hardens or goes slack, a drag of other powers, a few waves of any shape.

Their torque is linear in what is fitted, and two of them are one. So beside a spring a ripple or a mass off the axis
would be named for what a real spring, or a cable that only pulls, has beyond a straight line, and beside a drag a
Stribeck peak for what it has beyond a square. A ripple of few waves, and what makes gravity of another phase, are
together such a spring, too.
"""

from collections.abc import Iterator, Sequence
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.candidates import Candidate
from pipelines.effects import Cogging, Effect, ParallelSpring, Parameter, Parity, QuadraticDrag, Side, StribeckFriction
from pipelines.mechanics.motion import Motion

ANY_SIZE = (-1e6, 1e6)
"""Amplitudes of which none is absurd."""
BENDS, ANY_LAW = (2, 3, 4), tuple(range(11))
"""Powers of the angle: beside the straight line and the preload that a spring has itself, and of any law."""
STEEPER = 3
"""Power of speed above a drag's own; those below are viscous friction's."""


class FreerForm(Effect):
    """What a cause's own equation does not follow: nothing that could be named, only a form to hold others against."""

    instead: ClassVar[str]
    """That the cause it belongs to may be of this form, and how to see whether it is."""
    priced: ClassVar[int]
    """How many columns a machine's own law of this form would have: that ours needs more is no evidence against it."""
    alone: ClassVar[bool] = False
    """True where it stands in its cause's place, and not beside it: then it is a spring at that joint, too."""

    @classmethod
    def contains(cls, effect: Effect, of: Effect) -> bool:
        """Tell whether an effect is a part of this form of another."""
        return cls.alone and isinstance(effect, ParallelSpring) and effect.joint == of.joint


def _powers_of_angle(effect: Effect, motion: Motion, powers: Sequence[int]) -> NDArray:
    """Return powers of the angle, in travels of an exoskeleton's joint, (n, J, p)."""
    j = effect.column(motion)
    columns = np.zeros((*motion.q.shape, len(powers)))
    columns[:, j] = (motion.q[:, j] / effect.scale.travel)[:, np.newaxis] ** np.array(powers)
    return columns


def _amplitudes(powers: Sequence[int]) -> tuple[Parameter, ...]:
    return tuple(
        Parameter(f"power_{n}", "N·m", f"torque per angle to the power {n}", f"k{n}", ANY_SIZE) for n in powers
    )


class BentSpring(FreerForm):
    """What bends a spring's line."""

    name = "bent_spring"
    title = "Bent spring"
    side = Side.STRUCTURE
    equation = "tau = k2 (q / s)^2 + k3 (q / s)^3 + k4 (q / s)^4, s the joint's travel beside an exoskeleton's"
    linear = _amplitudes(BENDS)
    priced = len(BENDS)
    parity = Parity.EVEN
    instead = (
        "a spring that hardens, softens or goes slack would explain as much: hold the joint at several places and see "
        "whether the torque lies on a straight line"
    )

    def columns(self, motion: Motion, shape: NDArray | tuple[float, ...] = ()) -> NDArray:
        """Return the powers that bend, (n, J, p)."""
        return _powers_of_angle(self, motion, BENDS)


class LawOfAngle(FreerForm):
    """Any smooth torque that goes with the angle alone: what a ripple of few waves is no more than."""

    name = "law_of_angle"
    title = "Law of the angle"
    side = Side.STRUCTURE
    equation = "tau = k0 + k1 (q / s) + ... + k10 (q / s)^10, s the joint's travel beside an exoskeleton's"
    linear = _amplitudes(ANY_LAW)
    priced = 2 + len(BENDS)
    parity = Parity.EVEN
    instead = BentSpring.instead
    alone = True

    def columns(self, motion: Motion, shape: NDArray | tuple[float, ...] = ()) -> NDArray:
        """Return all powers, (n, J, p)."""
        return _powers_of_angle(self, motion, ANY_LAW)


class BentDrag(FreerForm):
    """What makes a drag steeper than the square of speed."""

    name = "bent_drag"
    title = "Bent drag"
    side = Side.DRIVE
    equation = "tau = c3 abs(v / s)^3 sgn(v), s the joint's speed beside an exoskeleton's"
    linear = (Parameter("bend", "N·m", "torque per speed to the third power", "c3", ANY_SIZE),)
    priced = 1
    parity = Parity.ODD
    instead = (
        "a drag of another power of speed would explain as much: move the joint at several constant speeds and see how "
        "its torque grows"
    )

    def columns(self, motion: Motion, shape: NDArray | tuple[float, ...] = ()) -> NDArray:
        """Return the power of speed, in speeds of an exoskeleton's joint, (n, J, 1)."""
        j = self.column(motion)
        speed = motion.dq[:, j] / self.scale.speed
        columns = np.zeros((*motion.q.shape, 1))
        columns[:, j, 0] = np.sign(speed) * np.abs(speed) ** STEEPER
        return columns


FORMS: dict[type[Effect], type[FreerForm]] = {ParallelSpring: BentSpring, QuadraticDrag: BentDrag, Cogging: LawOfAngle}
AS_RIVAL: dict[tuple[type[Effect], type[Effect]], type[FreerForm]] = {
    (StribeckFriction, QuadraticDrag): BentDrag,
    (Cogging, ParallelSpring): LawOfAngle,
}
"""By cause and rival at its joint: in which form the rival is held against it; others could be nearly anything so."""


def freeable(causes: Sequence[Candidate]) -> Iterator[tuple[Candidate, type[FreerForm]]]:
    """Yield those of the causes that have a freer form, and that form."""
    for cause in causes:
        if form := FORMS.get(type(cause.effect)):
            yield cause, form


def in_form(causes: Sequence[Candidate], label: str, form: type[FreerForm]) -> list[Candidate]:
    """Return the causes with that of a label in a form."""
    (cause,) = (cause for cause in causes if cause.label == label)
    rest = [c for c in causes if c is not cause or not form.alone]
    return [*rest, Candidate(form(cause.effect.joint, on=cause.effect.on), ((),) * len(cause.shapes))]

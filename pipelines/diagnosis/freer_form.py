"""Causes in a freer form: a spring that hardens, softens or goes slack, a drag of other powers of speed.

Their torque is linear in what is fitted, and two of them are one. So beside a spring a ripple or a mass off the axis
would be named for what a real spring, or a cable that only pulls, has beyond a straight line, and beside a drag a
Stribeck peak for what it has beyond a square.
"""

from collections.abc import Iterator, Sequence
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.candidates import Candidate
from pipelines.effects import Effect, ParallelSpring, Parameter, Parity, QuadraticDrag, Side
from pipelines.mechanics.motion import Motion

ANY = (-1e6, 1e6)
"""Amplitudes of which none is absurd."""
OF_ANGLE = (2, 3, 4)
"""Powers beside the straight line and the preload that a spring has itself."""
OF_SPEED = (3.0,)
"""Powers above a drag's own; below it is viscous friction's."""


class FreerForm(Effect):
    """What a cause's own equation does not follow: nothing that could be named, only a form to hold others against."""

    instead: ClassVar[str]
    """That the cause it belongs to may be of this form, and how to see whether it is."""
    imitates: ClassVar[bool] = False
    """True where it could be nearly anything at its joint: then its cause is nobody's rival in this form."""


class BentSpring(FreerForm):
    """What bends a spring's line."""

    name = "bent_spring"
    title = "Bent spring"
    side = Side.STRUCTURE
    equation = "tau = k2 (q / s)^2 + k3 (q / s)^3 + k4 (q / s)^4, s the joint's travel beside an exoskeleton's"
    linear = tuple(Parameter(f"bend_{n}", "N·m", f"torque per angle to the power {n}", f"k{n}", ANY) for n in OF_ANGLE)
    parity = Parity.EVEN
    imitates = True
    instead = (
        "a spring that hardens, softens or goes slack would explain as much: hold the joint at several angles and see "
        "whether the torque lies on a straight line"
    )

    def columns(self, motion: Motion, shape: NDArray | tuple[float, ...] = ()) -> NDArray:
        """Return powers of the angle, in travels of an exoskeleton's joint, (n, J, p)."""
        j = self.column(motion)
        columns = np.zeros((*motion.q.shape, len(OF_ANGLE)))
        columns[:, j] = (motion.q[:, j] / self.scale.travel)[:, np.newaxis] ** np.array(OF_ANGLE)
        return columns


class BentDrag(FreerForm):
    """What makes a drag of another power of speed than the second."""

    name = "bent_drag"
    title = "Bent drag"
    side = Side.DRIVE
    equation = "tau = c3 abs(v / s)^3 sgn(v), s the joint's speed beside an exoskeleton's"
    linear = tuple(
        Parameter(f"bend_{n:g}", "N·m", f"torque per speed to the power {n:g}", f"c{n:g}", ANY) for n in OF_SPEED
    )
    parity = Parity.ODD
    instead = (
        "a drag of another power of speed would explain as much: move the joint at several constant speeds and see how "
        "its torque grows"
    )

    def columns(self, motion: Motion, shape: NDArray | tuple[float, ...] = ()) -> NDArray:
        """Return powers of the speed, in speeds of an exoskeleton's joint, (n, J, p)."""
        j = self.column(motion)
        speed = motion.dq[:, j] / self.scale.speed
        columns = np.zeros((*motion.q.shape, len(OF_SPEED)))
        columns[:, j] = np.sign(speed)[:, np.newaxis] * np.abs(speed)[:, np.newaxis] ** np.array(OF_SPEED)
        return columns


OF: dict[type[Effect], type[FreerForm]] = {ParallelSpring: BentSpring, QuadraticDrag: BentDrag}


def freed(causes: Sequence[Candidate], label: str | None = None) -> Iterator[tuple[list[Candidate], type[FreerForm]]]:
    """Yield the causes with one of them in a freer form, that of a ``label`` if one is given, and that form."""
    for cause in causes:
        form = OF.get(type(cause.effect))
        if form is not None and label in (None, cause.label):
            free = form(cause.effect.joint, on=cause.effect.on)
            yield [*causes, Candidate(free, ((),) * len(cause.shapes))], form

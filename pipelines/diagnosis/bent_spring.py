"""A spring in a freer form: one that hardens, softens or goes slack.

A spring's torque is linear in what is fitted, and two of them are one. So beside it a ripple or a mass off the axis
would be named for what a real spring, or a cable that only pulls, has beyond a straight line.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.candidates import Candidate
from pipelines.effects import Effect, ParallelSpring, Parameter, Parity, Side
from pipelines.mechanics.motion import Motion

DEGREES = (2, 3, 4)
"""Of the angle, beside the straight line and the preload that a spring has itself."""
ANY = (-1e6, 1e6)
"""Amplitudes of which none is absurd."""


class BentSpring(Effect):
    """What bends a spring's line: no cause that could be named, only a form to hold others against."""

    name = "bent_spring"
    title = "Bent spring"
    side = Side.STRUCTURE
    equation = "tau = k2 (q / s)^2 + k3 (q / s)^3 + k4 (q / s)^4, s the joint's travel beside an exoskeleton's"
    linear = tuple(Parameter(f"bend_{n}", "N·m", f"torque per angle to the power {n}", f"k{n}", ANY) for n in DEGREES)
    parity = Parity.EVEN

    def columns(self, motion: Motion, shape: NDArray | tuple[float, ...] = ()) -> NDArray:
        """Return powers of the angle, in travels of an exoskeleton's joint, (n, J, p)."""
        j = self.column(motion)
        columns = np.zeros((*motion.q.shape, len(DEGREES)))
        columns[:, j] = (motion.q[:, j] / self.scale.travel)[:, np.newaxis] ** np.array(DEGREES)
        return columns


def bent(causes: Sequence[Candidate]) -> Iterator[list[Candidate]]:
    """Yield the causes with one of their springs in a freer form."""
    for cause in causes:
        if isinstance(cause.effect, ParallelSpring):
            form = BentSpring(cause.effect.joint, on=cause.effect.on)
            yield [*causes, Candidate(form, ((),) * len(cause.shapes))]

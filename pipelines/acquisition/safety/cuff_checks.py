"""Whether what cuff sensors tell can be true: forces that a sensor can resolve, and that change
while the leg moves."""

from collections.abc import Sequence
from math import isnan

from numpy.typing import NDArray

from pipelines.acquisition.safety.stuck_register import FROZEN_CYCLES, FROZEN_RAD, Held
from pipelines.mechanics.motion import CUFFS

LEAST_FORCE_N = 1e-6
"""No sensor resolves less; a float whose words are swapped often is."""


class Cuffs:
    """What each sensor told so far."""

    def __init__(self, sample_rate_hz: float) -> None:
        self._rate = sample_rate_hz
        self._held = {name: Held() for name in CUFFS}

    def doubt(self, forces: NDArray, cycle: int, travel: float) -> str | None:
        """Return why forces (4, 3) N cannot be true, None if they can; ``travel`` is how far joints
        were told to go."""
        for force, name in zip(forces.tolist(), CUFFS, strict=True):
            if any(map(isnan, force)):
                continue  # a sensor that was not read
            if any(abs(axis) < LEAST_FORCE_N and axis != 0.0 for axis in force):
                return (
                    f"sensor {name}: tells forces of {_three(force)} N, smaller than any sensor"
                    " resolves; check the word order in the rig file"
                )
            held = self._held[name]
            held.tell(tuple(force), cycle, travel)
            if cycle - held.since >= FROZEN_CYCLES and travel - held.travel > FROZEN_RAD:
                return (
                    f"sensor {name}: counts on, but tells forces of {_three(force)} N for"
                    f" {(cycle - held.since) / self._rate:.3f} s while the leg was told to move;"
                    " its registers are frozen"
                )
        return None


def _three(force: Sequence[float]) -> str:
    return ", ".join(f"{value:.3g}" for value in force)

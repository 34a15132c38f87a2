"""Whether cuff forces are plausible: measurable, and changing while the leg moves."""

from collections.abc import Sequence
from math import isnan

from numpy.typing import NDArray

from pipelines.acquisition.safety.stuck_register import STUCK_CYCLES, STUCK_RAD, StuckValue
from pipelines.mechanics.motion import CUFFS


class CuffChecks:
    """The last readings of each cuff sensor."""

    def __init__(self, sample_rate_hz: float) -> None:
        self._rate = sample_rate_hz
        self._held = {name: StuckValue() for name in CUFFS}

    def implausible(self, forces: NDArray, cycle: int, sent_travel: float) -> str | None:
        """Return why forces cannot be true, None if they can.

        Parameters
        ----------
        forces : (4, 3) array
            N; NaN where a sensor was not read.
        cycle : int
            The machine's cycle.
        sent_travel : float
            How far the joints were sent up to then, rad.
        """
        # No sensor resolves less: a smaller value but 0 is a float with swapped words.
        least_force_n = 1e-6
        for force, name in zip(forces.tolist(), CUFFS, strict=True):
            if any(map(isnan, force)):
                continue
            if any(abs(axis) < least_force_n and axis != 0.0 for axis in force):
                return (
                    f"sensor {name}: reports forces of {_three(force)} N, smaller than any sensor"
                    " resolves; check the word order in the rig file"
                )
            held = self._held[name]
            held.update(tuple(force), cycle, sent_travel)
            cycles, sent = cycle - held.since, sent_travel - held.sent_travel
            if cycles >= STUCK_CYCLES and sent > STUCK_RAD:
                return (
                    f"sensor {name}: its counter advances, but its forces stay {_three(force)} N"
                    f" for {cycles / self._rate:.3f} s while the leg was sent to move; its"
                    " registers are frozen"
                )
        return None


def _three(force: Sequence[float]) -> str:
    return ", ".join(f"{value:.3g}" for value in force)

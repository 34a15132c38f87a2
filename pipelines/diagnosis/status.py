"""What is left: explained, partly, unknown, or nothing missing to begin with."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.imperfection import imperfect_share
from pipelines.diagnosis.slow import SlowError
from pipelines.effects import Effect

AT_FLOOR = 1.03
"""RMSE over floor up to which a joint has no systematic error (CONTRACTS, verdict/1)."""
EXPLAINED = 0.2
"""Share of the systematic power that may be left of an explained joint."""
HELD_UP = 0.2
"""Share of the systematic power that the named causes must take away on validation runs to stay named."""
FOREIGN = 0.3
"""Share of the systematic power from which what is left, if it is plain, is not a form of a named cause.

Three causes together can imitate nearly anything: of them a third of that.
"""
WORSE = 1.03
"""Ratio of a joint's errors from which causes do harm there."""
NEXT_TO_NOTHING = 0.05
"""Share of the systematic power below which nothing is left that a cause should have explained."""
RINGING = 0.5
"""Share of the systematic power below which what is left beside a soft transmission may be its ringing."""
PLAIN = 6.0
"""Standard errors of the floor's power by which what is left must exceed it to be plain."""
SIGNIFICANT = 3.5
"""Standard errors of the floor's power by which slow error must exceed it to be systematic."""
MATERIAL = 0.25
"""Share of the noise floor from which slow error is worth an alarm: 3 % of the error that a user sees."""
IMPERFECT = 0.015
"""Share of a joint's torque up to which slow error is that of a good rig: several things off by half a percent each."""
HUM = 0.35
"""Share of the noise floor from which a tone is none of the noise's own lines: those reach 0.25."""
WANDERING = 3.0
"""Slow scatter between periods over that of noise, from which something moves that does not repeat."""


@dataclass(frozen=True)
class Standing:
    """Errors of the validation runs, of each joint (J,) N·m but for those told otherwise."""

    floor: NDArray
    baseline: NDArray
    extended: NDArray
    slow_before: SlowError
    slow_after: SlowError
    torque: NDArray
    """(O,) rms of what was measured, N·m, less a constant that tells nothing."""

    @property
    def unexplained(self) -> list[float | None]:
        """Share of each joint's systematic power that is left; None where there was none."""
        shares: list[float | None] = []
        for floor, before, after in zip(self.floor, self.baseline, self.extended, strict=True):
            if not before > AT_FLOOR * floor:
                shares.append(None)
            else:
                shares.append(float(max(after**2 - floor**2, 0.0) / (before**2 - floor**2)))
        return shares

    @property
    def takes_enough(self) -> bool:
        """Whether the named causes take away enough, in drives and cuffs together, and no drive's error grows."""
        worse = self.extended > WORSE * self.baseline
        together = np.sum((self.extended / self.floor) ** 2) <= np.sum((self.baseline / self.floor) ** 2)
        return self._share_left <= 1.0 - HELD_UP and bool(together) and not bool(worse.any())

    @property
    def leaves_nothing(self) -> bool:
        """Whether the causes take nearly all power of slow error, and there was some: a hum is another matter then."""
        return bool(np.any(self.systematic(self.slow_before))) and self._share_left < NEXT_TO_NOTHING

    @property
    def drowns(self) -> bool:
        """Whether the named causes take next to nothing of an error that is louder than the noise.

        What is as loud may pass for what is heard or felt.
        """
        worst, left = self._left_at_the_worst()
        loud = self.systematic(self.slow_after) & (self.slow_after.excess[: len(self.floor)] > self.floor)
        return bool(loud[worst]) and left > 1.0 - HELD_UP

    def rings(self, effects: Sequence[Effect]) -> bool:
        """Tell whether what is left may be the ringing of a named transmission, which takes most of the error away."""
        return any(effect.rings for effect in effects) and self._share_left < RINGING

    def held_up(self, effects: Sequence[Effect]) -> bool:
        """Tell whether the named effects take away enough, everywhere and at the worst joint.

        The ringing of a transmission no model follows to the end, nor what goes with wall time: a drift that bends,
        a rhythm that wanders.
        """
        if not self.takes_enough:
            return False
        worst, left = self._left_at_the_worst()
        plain = self.systematic(self.slow_after)[worst] and self.slow_after.sureness[worst] > PLAIN
        rings = any(effect.rings for effect in effects)
        if len(effects) > 2:
            return not plain or left < FOREIGN / 3 or (rings and self._share_left < FOREIGN)
        return not plain or left < FOREIGN or rings or any(effect.goes_with_time for effect in effects)

    @property
    def _share_left(self) -> float:
        """Share of all outputs' systematic power that is left; 1 where there was none."""
        before, after = (np.sum(power) for power in self._powers())
        return float(after / before) if before > 0 else 1.0

    def _left_at_the_worst(self) -> tuple[int, float]:
        """Return the joint where the systematic error was largest, and the share of its power that is left there."""
        before, after = self._powers()
        worst = int(np.argmax(before[: len(self.floor)]))
        return worst, float(after[worst] / before[worst]) if before[worst] > 0 else 1.0

    def _powers(self) -> tuple[NDArray, NDArray]:
        """Return the systematic power before and after beyond a good rig's, in units of the floor's, (O,) each.

        A cuff's noise is so small that what is a little off in it always would outweigh what is missing in a drive.
        Where nothing is beyond a good rig's, what there is counts.
        """
        slow = self.slow_before.over(self.slow_after), self.slow_after
        good = imperfect_share(len(self.torque)) * self.torque
        if not np.any(slow[0].excess > good):
            good = np.zeros_like(good)
        before, after = (np.maximum(s.excess**2 - good**2, 0.0) / s.floor**2 for s in slow)
        return before, after

    @property
    def trust(self) -> float:
        """How far what is explained at the worst joint speaks for the causes, 0.5 to 1.

        1 where they leave nothing; a half, plus half of the share explained, where they plainly leave some: so often
        were they right on tuning sessions.
        """
        worst, left = self._left_at_the_worst()
        sure = np.clip(self.slow_after.sureness[worst] / PLAIN, 0.0, 1.0)
        return float(1.0 - 0.5 * min(left, 1.0) * sure)

    def systematic(self, slow: SlowError) -> NDArray:
        """Tell at which joints an error is beyond chance, beyond the floor and beyond a good rig's, (J,) bool."""
        J = len(self.floor)
        large = slow.excess[:J] > np.maximum(MATERIAL * self.floor, IMPERFECT * self.torque[:J])
        return np.asarray(large & (slow.sureness[:J] > SIGNIFICANT))

    def of_a_good_rig(self, joint: int) -> float | None:
        """Return which share of a joint's torque an error is that is plain, though a good rig's; None of others."""
        slow = self.slow_before
        plain = slow.excess[joint] > MATERIAL * self.floor[joint] and slow.sureness[joint] > SIGNIFICANT
        return float(slow.excess[joint] / self.torque[joint]) if plain else None

    def hums(self, before: NDArray, after: NDArray, floor: NDArray) -> bool:
        """Tell whether a tone (J,) N·m is left that is beyond the floor and beyond a good rig's at some joint.

        ``floor`` (J,) N·m is that of the band in which tones are sought, which may be wider than the one looked at.

        What is left of those that the named causes took most of, at all joints together, is the misfit of their form:
        what hums at one joint shakes the others too.
        """
        loud = after > np.maximum(HUM * floor, IMPERFECT * self.torque[: len(self.floor)])
        was, left = (np.sum((tone / floor) ** 2) for tone in (before, after))
        return bool(np.any(loud) and left > FOREIGN * was)

    def is_minor(self, tone: NDArray) -> bool:
        """Tell whether a tone (J,) N·m is as small beside the error that there was as what may be left of a cause.

        A resonance that one run happens to excite is something else that is missing; it is no reason to doubt what
        explains several times as much. A tone that is slow enough to be in that error counts in full.
        """
        was = self.slow_before.excess[: len(self.floor)]
        return bool(np.sum((tone / self.floor) ** 2) < FOREIGN * np.sum((was / self.floor) ** 2))


def status_of(standing: Standing, named: bool, wandering: bool) -> str:
    """Return the verdict's status."""
    if not named:
        alarmed = bool(np.any(standing.systematic(standing.slow_before))) or wandering
        return "unknown_cause" if alarmed else "nothing_missing"
    left = [share for share in standing.unexplained if share is not None]
    return "explained" if all(share <= EXPLAINED for share in left) else "partly_explained"

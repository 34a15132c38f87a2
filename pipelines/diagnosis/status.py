"""What is left: explained, partly, unknown, or nothing missing to begin with."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

AT_FLOOR = 1.03
"""RMSE over floor up to which a joint has no systematic error (CONTRACTS, verdict/1)."""
EXPLAINED = 0.2
"""Share of the systematic power that may be left of an explained joint."""
HELD_UP = 0.2
"""Share of the systematic power that the named causes must take away on validation runs to stay named."""
SIGNIFICANT = 3.0
"""Standard errors of the floor by which an error must exceed it to be systematic."""
MATERIAL = 1.08
"""RMSE over floor from which an error that nothing explains is worth an alarm."""
WANDERING = 3.0
"""Slow over fast scatter between periods from which something moves that does not repeat."""


@dataclass(frozen=True)
class Standing:
    """Errors of each joint on the validation runs, (J,) N·m each."""

    floor: NDArray
    baseline: NDArray
    extended: NDArray
    independent: NDArray
    """(J,) independent samples."""

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
    def held_up(self) -> bool:
        """Whether the named causes take away enough where there is most to take."""
        power = self.baseline**2 - self.floor**2
        worst = int(np.argmax(power / self.floor**2))
        left = self.unexplained[worst]
        return left is None or left < 1.0 - HELD_UP

    def systematic(self, rms: NDArray) -> NDArray:
        """Tell at which joints an error is beyond the floor, beyond chance and beyond a good rig's, (J,) bool."""
        chance = SIGNIFICANT * np.sqrt(2.0 / np.maximum(self.independent, 1.0))
        return (rms / self.floor) ** 2 > np.maximum(MATERIAL**2, 1.0 + chance)


def status_of(standing: Standing, named: bool, wandering: bool) -> str:
    """Return the verdict's status."""
    if not named:
        alarmed = bool(np.any(standing.systematic(standing.baseline))) or wandering
        return "unknown_cause" if alarmed else "nothing_missing"
    left = [share for share in standing.unexplained if share is not None]
    return "explained" if all(share <= EXPLAINED for share in left) else "partly_explained"

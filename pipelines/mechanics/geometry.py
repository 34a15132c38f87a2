"""Lengths and gravity of a machine: what is measured, not identified."""

from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Geometry:
    """Lengths and gravity that are measured, not identified. SI units."""

    thigh_length_m: float = 0.38952
    """First to second joint axis; a machine of one joint has no use for it."""
    gravity_m_s2: float = 9.8
    """0 where the joints turn about vertical axes; of a prismatic joint, along its axis."""
    thigh_cuff_distance_m: float | None = None
    """Hip axis to thigh cuff; None where there are no cuff forces."""
    shank_cuff_distance_m: float | None = None
    """Knee axis to shank cuff; None where there are no cuff forces."""

    @property
    def has_cuffs(self) -> bool:
        """Whether it says where both cuffs are."""
        return None not in (self.thigh_cuff_distance_m, self.shank_cuff_distance_m)

    def metadata(self) -> dict[str, float]:
        """Return what a file says of it; lengths that are not known are left out."""
        return {key: value for key, value in asdict(self).items() if value is not None}

    def array(self) -> NDArray:
        """Return what compiled kernels receive as ``geometry``, (2,): thigh length (m), gravity
        (m/s²)."""
        return np.array([self.thigh_length_m, self.gravity_m_s2])

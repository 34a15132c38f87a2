"""Lengths and gravity of a machine, which are measured and not identified."""

from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Geometry:
    """Lengths and gravity that are measured, not identified; SI units."""

    # The defaults are the paper's. A recording's geometry has priority, then that of exoid.toml.
    thigh_length_m: float = 0.38952
    """First to second joint axis; unused for a machine of one joint."""
    gravity_m_s2: float = 9.8
    """0 for vertical joint axes; along the axis of a prismatic joint."""
    thigh_cuff_distance_m: float | None = None
    """Hip axis to thigh cuff; None without cuff forces."""
    shank_cuff_distance_m: float | None = None
    """Knee axis to shank cuff; None without cuff forces."""

    @property
    def has_cuffs(self) -> bool:
        """Whether the positions of both cuffs are known."""
        return None not in (self.thigh_cuff_distance_m, self.shank_cuff_distance_m)

    def metadata(self) -> dict[str, float]:
        """Return the geometry for a file's metadata, without unknown lengths."""
        return {key: value for key, value in asdict(self).items() if value is not None}

    def array(self) -> NDArray:
        """Return the argument ``geometry`` of kernels.

        Returns
        -------
        (2,) array
            Thigh length, m, and gravity, m/s².
        """
        return np.array([self.thigh_length_m, self.gravity_m_s2])

"""The design stage: search for an excitation, assess it, and write it as a table."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from pipelines.contracts.joints import columns_of
from pipelines.design.lines import detection_lines
from pipelines.design.multisine import multisine
from pipelines.design.quality import Quality, quality
from pipelines.design.search import Report, search
from pipelines.mechanics.fourier import FourierTrajectory
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.limits import QUANTITIES
from pipelines.settings.design import DesignSettings


@dataclass(frozen=True)
class Design:
    """A designed excitation."""

    trajectory: FourierTrajectory
    quality: Quality
    settings: DesignSettings
    stopped_by: str

    @property
    def detection_lines(self) -> list[int]:
        """Harmonics left empty to measure noise and distortion at; none in most excitations."""
        return detection_lines(self.trajectory)

    def frame(self) -> pd.DataFrame:
        """Return one period as rows of a ``trajectory/1`` table.

        Returns
        -------
        DataFrame
            Samples at ``sample_rate_hz``; the next period begins where the table ends.
        """
        rows = round(self.trajectory.period_s * self.settings.sample_rate_hz)
        time = np.arange(rows) / self.settings.sample_rate_hz
        states = dict(zip(QUANTITIES, self.trajectory.at(time), strict=True))
        return pd.DataFrame({"time_s": time} | columns_of(self.trajectory.joints, states))

    def metadata(self) -> dict[str, Any]:
        """Return the coefficients and their quality for a file's metadata."""
        return {
            "omega_rad_s": self.trajectory.omega,
            "theta0_rad": self.trajectory.theta0.tolist(),
            "a": self.trajectory.a.tolist(),
            "b": self.trajectory.b.tolist(),
            "criterion": self.settings.criterion,
            "criterion_value": self.quality.value(self.settings.criterion),
            **({"detection_lines": self.detection_lines} if self.detection_lines else {}),
            **self.quality.as_metadata(),
            "seed": self.settings.seed,
            "stopped_by": self.stopped_by,
        }


def design(
    settings: DesignSettings,
    geometry: Geometry | None = None,
    report: Report = lambda done, note: None,
) -> Design:
    """Design an excitation.

    Equal settings give an equal excitation, unless ``seconds`` ended the search.

    Parameters
    ----------
    settings : DesignSettings
        Bounds, harmonics, criterion and effort of the search.
    geometry : Geometry, optional
        Lengths of the leg, m; the paper's by default.
    report : callable, optional
        Called with the share that is done, 0 to 1, and a note.

    Returns
    -------
    Design
        The best excitation and its quality.
    """
    geometry = geometry or Geometry()
    find = multisine if settings.criterion == "multisine" else search
    trajectory, stopped_by = find(settings, geometry, report)
    return Design(trajectory, quality(trajectory, settings, geometry), settings, stopped_by)

"""A chart as data, which the page draws with uPlot and figure files with matplotlib."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipelines.contracts.joints import Joint
from pipelines.plotting.downsampling import extremes


class Role(StrEnum):
    """The role of a curve, which determines its colour."""

    MEASURED = "measured"
    WANTED = "wanted"
    BEFORE = "before"
    AFTER = "after"


class Mark(StrEnum):
    """How a curve is drawn."""

    LINE = "line"
    DOTS = "dots"
    MEAN = "mean"
    """A thick line through few points, across rows without a value."""


@dataclass(frozen=True)
class DrawnTable:
    """A table whose columns are drawn as curves of one role."""

    words: str
    """Words of the legend."""
    role: Role
    rows: pd.DataFrame


@dataclass(frozen=True)
class Series:
    """One curve, values (n,); NaN interrupts a ``LINE``."""

    label: str
    values: NDArray
    role: Role
    mark: Mark = Mark.LINE


@dataclass(frozen=True)
class Panel:
    """Curves on one axis."""

    label: str
    """Label of the vertical axis, with the unit."""
    series: tuple[Series, ...]
    band: float | None = None
    """Half the height of the noise floor's band about zero."""
    reach: float | None = None
    """Half the height shown; None for the height of all curves."""


def named(joint: Joint, panel: Panel) -> Panel:
    """Return a panel whose label begins with the name of its joint."""
    return replace(panel, label=f"{joint.name} {panel.label}")


@dataclass(frozen=True)
class Chart:
    """Panels one above the other that share their horizontal axis."""

    key: str
    """Name in links and of the file."""
    title: str
    caption: str
    x_label: str
    x: NDArray
    """(n,), not decreasing."""
    panels: tuple[Panel, ...]
    group: str = ""
    """Charts of one group zoom together."""
    rows: int = field(default=0)
    """Number of rows before thinning; 0 if it was not thinned."""

    @property
    def width(self) -> int:
        """Number of columns, x among them."""
        return 1 + sum(len(panel.series) for panel in self.panels)

    @property
    def all_series(self) -> list[Series]:
        """Every curve, panel by panel."""
        return [series for panel in self.panels for series in panel.series]

    def thinned(self, rows: int) -> "Chart":
        """Return the chart with fewer rows, but with every peak.

        Parameters
        ----------
        rows : int
            Greatest number of rows.
        """
        if len(self.x) <= rows:
            return self
        # One choice of rows for all curves, because they share x.
        kept = extremes(np.column_stack([series.values for series in self.all_series]), rows)
        panels = tuple(
            replace(panel, series=tuple(replace(s, values=s.values[kept]) for s in panel.series))
            for panel in self.panels
        )
        return replace(self, x=self.x[kept], panels=panels, rows=len(self.x))


def thinned_alike(charts: Sequence[Chart], values: int) -> list[Chart]:
    """Return charts with a limited number of values in total, the longest thinned first.

    Parameters
    ----------
    charts : sequence of Chart
        Charts of one page.
    values : int
        Greatest number of values of all charts.
    """
    # Bisection for the largest common number of rows: short charts stay whole, long ones share.
    low, high = 1, max((len(chart.x) for chart in charts), default=1)
    while low < high:
        rows = (low + high + 1) // 2
        if sum(min(rows, len(chart.x)) * chart.width for chart in charts) <= values:
            low = rows
        else:
            high = rows - 1
    return [chart.thinned(low) for chart in charts]

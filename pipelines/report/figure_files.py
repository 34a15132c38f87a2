"""The figures of a session's page as PDF and PNG files."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from pipelines.plotting.matplotlib_charts import chart_figure
from pipelines.plotting.style import STYLE, save
from pipelines.report.bar_figures import budget_figure, falls_figure
from pipelines.report.sections.error_budget import budget, falls
from pipelines.report.session import Session
from pipelines.report.session_charts import charts

Drawings = dict[str, Callable[[], Figure]]
"""Functions that draw a figure, by the name of its file."""


def figures(session: Session) -> Drawings:
    """Return the functions that draw the figures of a session's page, by file name."""
    drawings: Drawings = {}
    if session.verdict:
        drawings["error"] = partial(falls_figure, falls(session.verdict))
        drawings["error-budget"] = partial(budget_figure, budget(session.verdict))
    # Functions, not figures: a session has dozens, and only the chosen ones are drawn.
    return drawings | {chart.key: partial(chart_figure, chart) for chart in charts(session).all}


def draw(
    drawings: Drawings, names: Sequence[str], folder: Path, report: Callable[[float], None]
) -> None:
    """Write figures as PDF and PNG into a folder; ``report`` receives the number written."""
    with plt.rc_context(STYLE | {"savefig.dpi": 200}):
        for number, name in enumerate(names):
            save(drawings[name](), folder / name)
            report(number + 1)

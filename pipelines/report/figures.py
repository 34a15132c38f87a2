"""Every figure of a session's page, by name, to be drawn on paper."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from pipelines.plotting.style import STYLE, save
from pipelines.report.charts.matplotlib_charts import budget_figure, chart_figure, falls_figure
from pipelines.report.report import charts
from pipelines.report.sections.error_budget import budget, falls
from pipelines.report.session import Session

DPI = 200
"""Of PNG: what is printed is seen from nearer than a screen."""

Drawings = dict[str, Callable[[], Figure]]
"""What draws each figure, by the name of its file."""


def figures(session: Session) -> Drawings:
    """Return what draws each figure of a session's page, by the name of its file."""
    drawings: Drawings = {}
    if session.verdict:
        drawings["error"] = partial(falls_figure, falls(session.verdict))
        drawings["error-budget"] = partial(budget_figure, budget(session.verdict))
    return drawings | {
        chart.key: partial(chart_figure, chart) for chart in charts(session, values=None).all
    }


def draw(
    drawn: Drawings, names: Sequence[str], folder: Path, report: Callable[[float], None]
) -> None:
    """Write figures as PDF and PNG into a folder; ``report`` hears how many are done."""
    with plt.rc_context(STYLE | {"savefig.dpi": DPI}):
        for number, name in enumerate(names):
            figure = drawn[name]()
            figure.draw_without_rendering()  # its layout is known only then, and `save` measures it
            save(figure, folder / name)
            report(number + 1)

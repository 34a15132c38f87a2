"""The page of one session: its sections, and its charts thinned to the size of a page."""

from pathlib import Path
from typing import Any

from pipelines.report.html.page import LARGEST_BYTES, VALUES, render
from pipelines.report.sections import (
    animation,
    candidates,
    causes,
    commands,
    control,
    decision,
    error_budget,
    excitation,
    headline,
    key_figures,
    parameters,
    provenance,
    recordings,
    residuals,
    standstill,
    symbols,
    validation_runs,
)
from pipelines.report.sections.section import Content
from pipelines.report.session import Session
from pipelines.report.session_charts import charts

SECTIONS = (
    headline,
    decision,
    key_figures,
    standstill,
    error_budget,
    validation_runs,
    residuals,
    causes,
    candidates,
    parameters,
    symbols,
    excitation,
    recordings,
    control,
    animation,
    commands,
    provenance,
)
"""In the order of the page."""


def report(session: Session, title: str | None = None, output: Path | None = None) -> str:
    """Return the page of a session, its charts thinned until it is below ``LARGEST_BYTES``.

    Parameters
    ----------
    session : Session
    title : str, optional
        The page's title; the session's name unless given.
    output : Path, optional
        Where the page is written, for the command line that repeats it.
    """
    # Numbers in all charts below which thinning no longer makes the page smaller.
    fewest_values = 20_000
    values = VALUES
    page = _page(session, title, output, values)
    while len(page.encode()) > LARGEST_BYTES and values > fewest_values:
        # The words of a page have a length of their own, so the room for numbers is found by
        # trying.
        values //= 2
        page = _page(session, title, output, values)
    return page


def _page(session: Session, title: str | None, output: Path | None, values: int) -> str:
    content = Content(session, charts(session, values), title, output)
    context: dict[str, Any] = {}
    for section in SECTIONS:
        context |= section.context(content)
    return render(
        "report.html", content.charts.all, context["animations"], context, session.artifacts
    )

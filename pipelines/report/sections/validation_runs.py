"""Each run with its charts of measured and simulated motion, and a table of errors."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from pipelines.plotting.chart import Chart
from pipelines.report.sections.fit_quality import Score, models_of, replayed, run_names, scores
from pipelines.report.sections.not_simulated import lacks_causes, refusal
from pipelines.report.sections.section import Content
from pipelines.report.session import Session
from pipelines.wording.numbers import digits


@dataclass(frozen=True)
class ShownRun:
    """One run's charts and errors."""

    name: str
    about: str
    charts: tuple[Chart, ...]
    replayed: bool
    models: tuple[str, ...]
    """Headings of the columns of scores."""
    scores: tuple[Score, ...]
    lacks_causes: bool
    """Whether only the model without the causes was simulated."""
    refusal: str
    """Why the model with the causes cannot be simulated; empty if it can."""


def context(content: Content) -> dict[str, Any]:
    """Return the values of the template's part on measured and simulated motion."""
    scoring = content.verdict.scoring if content.verdict else {}
    return {"runs": _runs(content), "mask": scoring.get("mask") or "slow motion"}


def _runs(content: Content) -> list[ShownRun]:
    session = content.session
    replays = replayed(session)
    models = tuple(words for _, words in models_of(session).values())
    names = dict.fromkeys([*run_names(session), *replays])
    runs = []
    # Runs with a person first, by their usual names; the sort keeps all other order.
    for name in sorted(names, key=lambda name: "human" not in name):
        charts = tuple(chart for chart in content.charts.measured if chart.group == name)
        table = (models, tuple(scores(session, name)))
        lacking = (lacks_causes(session, name), refusal(session, name))
        runs.append(
            ShownRun(name, _about(session, name), charts, name in replays, *table, *lacking)
        )
    return runs


def _about(session: Session, name: str) -> str:
    if session.residuals is None:
        return ""
    rows = session.residuals.frame
    rows = rows[rows["file"] == name]
    if not len(rows):
        return ""
    kind = {"exo_alone": "nobody in it", "with_human": "with a person"}[rows["run"].iloc[0]]
    return f"{kind}, {digits(float(np.ptp(rows['time_s'])))} s"

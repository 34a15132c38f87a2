"""Each run with its charts of measured and simulated motion, and a table of errors."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from pipelines.dynamics.plant import plant_from_table
from pipelines.errors import ExoidError
from pipelines.plotting.chart import Chart
from pipelines.report.sections.fit_quality import (
    models_of,
    replayed,
    residuals_of,
    run_names,
    scores,
)
from pipelines.report.session import Session
from pipelines.wording.causes import labels_in_words
from pipelines.wording.numbers import digits


def runs(session: Session, charts: Sequence[Chart]) -> list[dict[str, Any]]:
    """Return the values of the template's part on each run, from the charts of all."""
    replays = replayed(session)
    # Runs with a person first, by their usual names; the sort keeps all other order.
    names = dict.fromkeys([*run_names(session), *replays])
    return [
        {
            "name": name,
            "about": _about(session, name),
            "charts": [chart for chart in charts if chart.group == name],
            "replayed": name in replays,
            "models": [words for _, words in models_of(session).values()],
            "scores": scores(session, name),
            "lacks_causes": _lacks_causes(session, name),
            "refusal": refusal(session, name),
        }
        for name in sorted(names, key=lambda name: "human" not in name)
    ]


def _about(session: Session, name: str) -> str:
    rows = residuals_of(session, name)
    if not len(rows):
        return ""
    kind = {"exo_alone": "nobody in it", "with_human": "with a person"}[rows["run"].iloc[0]]
    return f"{kind}, {digits(float(np.ptp(rows['time_s'])))} s"


def _lacks_causes(session: Session, run: str) -> bool:
    """Return whether causes are named, but the run was simulated without them only."""
    is_named = session.extended is not None and "extended" in models_of(session)
    return is_named and set(replayed(session).get(run, {})) == {"baseline"}


def refusal(session: Session, run: str) -> str:
    """Return why a run cannot be simulated with the causes; empty if it was, or can be.

    No file holds the reason, so the forward dynamics are built again.
    """
    if session.extended is None or not _lacks_causes(session, run):
        return ""
    kind = replayed(session)[run]["baseline"].metadata.get("plant", {}).get("run")
    try:
        plant_from_table(session.table(session.extended), kind or "with_human")
    except ExoidError as error:
        # The rest of the message advises the user of `exoid simulate`.
        reason, _, _ = str(error).partition("; ")
        return labels_in_words(reason, [cause.label for cause in session.causes])
    return ""

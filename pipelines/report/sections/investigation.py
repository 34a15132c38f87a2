"""The card of an investigation: how probable each cause was after each step."""

from typing import Any

from pipelines.report.session import Session
from pipelines.wording.investigation import history
from pipelines.wording.label import NOTHING, label_in_words
from pipelines.workflow.investigation import last_step, verdicts_before_steps


def investigation(session: Session) -> dict[str, Any] | None:
    """Return the values of the template's card.

    None where nothing was investigated, or where the verdict of a step is damaged, which the page
    names elsewhere.
    """
    out = next((folder for folder in session.folders if last_step(folder)), None)
    if out is None or session.verdict_file is None:
        return None
    if not session.unreadable.keys().isdisjoint(verdicts_before_steps(out)):
        return None
    steps = history(out, session.verdict_file.path)
    labels = dict.fromkeys(label for one in steps for label in one.probabilities)
    return {
        "steps": [{"step": one.step, "runs": one.runs, "decides": one.decides} for one in steps],
        "rows": [
            {
                "words": "nothing is missing" if label == NOTHING else label_in_words(label),
                "probabilities": [one.probabilities.get(label, 0.0) for one in steps],
            }
            for label in labels
        ],
    }

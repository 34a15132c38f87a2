"""The reason why a run was replayed without the causes only."""

from pipelines.dynamics.plant import plant_from_table
from pipelines.errors import ExoidError
from pipelines.report.sections.fit_quality import models_of, replayed
from pipelines.report.session import Session
from pipelines.wording.causes import labels_in_words


def lacks_causes(session: Session, run: str) -> bool:
    """Return whether causes are named, but the run was simulated without them only."""
    is_named = session.extended is not None and "extended" in models_of(session)
    return is_named and set(replayed(session).get(run, {})) == {"baseline"}


def refusal(session: Session, run: str) -> str:
    """Return why a run cannot be simulated with the causes; empty if it was, or can be.

    No file holds the reason, so the forward dynamics are built again.
    """
    if session.extended is None or not lacks_causes(session, run):
        return ""
    kind = replayed(session)[run]["baseline"].metadata.get("plant", {}).get("run")
    try:
        plant_from_table(session.table(session.extended), kind or "with_human")
    except ExoidError as error:
        # The rest of the message advises the user of `exoid simulate`.
        reason, _, _ = str(error).partition("; ")
        return labels_in_words(reason, [cause.label for cause in session.causes])
    return ""

"""Why a model with its causes was not simulated, where a run was replayed without them alone."""

from pipelines.dynamics.plant import plant_from_table
from pipelines.errors import ExoidError
from pipelines.report.sections.error_budget import labels_in_words
from pipelines.report.sections.fit_quality import models_of, replayed
from pipelines.report.session import Session
from pipelines.wording.label import cause_label


def lacks_causes(session: Session, run: str) -> bool:
    """Tell whether a run was simulated without the causes, and not with them, where some are
    named."""
    is_named = session.extended is not None and "extended" in models_of(session)
    return is_named and set(replayed(session).get(run, {})) == {"baseline"}


def unmoved(session: Session, run: str) -> str:
    """Return why a run's model with the causes cannot move; nothing where it was simulated, or
    could be.

    The forward dynamics are asked, which is what refused it: no file tells.
    """
    if session.extended is None or not lacks_causes(session, run):
        return ""
    kind = replayed(session)[run]["baseline"].metadata.get("plant", {}).get("run")
    try:
        plant_from_table(session.table(session.extended), kind or "with_human")
    except ExoidError as error:
        # What follows tells those who asked for a simulation what to do.
        what, _, _ = str(error).partition("; ")
        return labels_in_words(
            what, [cause_label(cause) for cause in (session.verdict or {}).get("causes", [])]
        )
    return ""

"""The page of one session: its sections, and its charts thinned to the size of a page."""

from pathlib import Path
from typing import Any

from pipelines.report.html.page import render
from pipelines.report.sections import headline, provenance, residuals
from pipelines.report.sections.animation import animations, drawn_as
from pipelines.report.sections.candidates import candidates
from pipelines.report.sections.causes import card
from pipelines.report.sections.commands import commands
from pipelines.report.sections.control import comparison, loops_of
from pipelines.report.sections.decision import decision
from pipelines.report.sections.error_budget import budget, falls, with_causes
from pipelines.report.sections.excitation import excitation
from pipelines.report.sections.investigation import investigation
from pipelines.report.sections.key_figures import tiles
from pipelines.report.sections.parameters import models, side_by_side
from pipelines.report.sections.recordings import recordings
from pipelines.report.sections.symbols import terms
from pipelines.report.sections.validation_runs import runs
from pipelines.report.session import Session
from pipelines.report.session_charts import Charts, charts
from pipelines.wording.increased_errors import increased_errors


def report(session: Session, title: str | None = None, output: Path | None = None) -> str:
    """Return the page of a session, its charts thinned until it is below 5 MB.

    Parameters
    ----------
    session : Session
    title : str, optional
        The page's title; the session's name unless given.
    output : Path, optional
        Where the page is written, for the command line that repeats it.
    """
    # Numbers in all charts: 5.3 bytes each as base64, which leaves room for words.
    values = 600_000
    page = _page(session, title, output, values)
    # The words of a page have a length of their own, so the room for numbers is found by trying.
    # Fewer numbers than that no longer make it smaller.
    while len(page.encode()) > 5_000_000 and values > 20_000:
        values //= 2
        page = _page(session, title, output, values)
    return page


def _page(session: Session, title: str | None, output: Path | None, values: int) -> str:
    drawn, moving = charts(session, values), animations(session)
    lines = commands(session, output, title)
    context = _context(session, drawn) | {
        "title": title or session.name,
        "commands": lines,
        "lacks_settings": not session.config and any("--config" in line for line in lines),
        "animations": moving,
    }
    return render("report.html", drawn.all, moving, context, session.artifacts)


def _context(session: Session, drawn: Charts) -> dict[str, Any]:
    """Return the values of the page's template, in its order."""
    verdict, shown = session.verdict, models(session)
    context: dict[str, Any] = {
        **headline.context(session),
        "decision": decision(verdict) if verdict else None,
        "investigation": investigation(session),
        "hero": drawn.hero,
        "runs": runs(session, drawn.measured),
        "mask": (verdict.scoring.get("mask") if verdict else None) or "slow motion",
        "residuals": residuals.by_joint(session, drawn.residuals),
        "causes": [card(cause) for cause in session.causes],
        "candidates": candidates(session),
        "has_baseline": bool(session.baselines),
        "models": shown,
        "parameters": side_by_side(shown),
        "terms": terms(session),
        "excitations": [excitation(session, one) for one in session.of_kind("trajectory")],
        "recordings": recordings(session),
        "control": comparison(verdict) if verdict else None,
        "control_is_compared": "extended" in loops_of(session),
        "loops": drawn.control,
        "is_leg": drawn_as(session) == "leg",
        **provenance.context(session),
    }
    if verdict:
        context |= {
            "tiles": tiles(session),
            "falls": falls(verdict),
            "with_causes": with_causes(verdict),
            "worse": increased_errors(verdict, session.joints),
            "budget": budget(verdict),
        }
    return context

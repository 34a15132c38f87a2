"""The report of one session: what stands in each of its six parts."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from pipelines.contracts import Joint
from pipelines.contracts.joints import either
from pipelines.report.charts.chart import Chart, thinned_alike
from pipelines.report.numbers import digits
from pipelines.report.page import LARGEST_BYTES, VALUES, indented, render
from pipelines.report.sections import provenance
from pipelines.report.sections.animation import animations, drawn_as
from pipelines.report.sections.control import control_charts, loops
from pipelines.report.sections.decision import decision
from pipelines.report.sections.error_budget import (
    any_label_in_words,
    budget,
    cause_in_words,
    causes_in_words,
    falls,
    labels_in_words,
    shares_in_words,
    ties_of,
)
from pipelines.report.sections.excitation import excitations
from pipelines.report.sections.fit_quality import (
    Score,
    angle_charts,
    models_of,
    replayed,
    run_names,
    scores,
    torque_charts,
)
from pipelines.report.sections.key_figures import tiles, worst_joint
from pipelines.report.sections.lead import faults_in_short, lead
from pipelines.report.sections.not_simulated import lacks_causes, unmoved
from pipelines.report.sections.parameters import models, side_by_side
from pipelines.report.sections.per_run_values import own_values
from pipelines.report.sections.recordings import Run
from pipelines.report.sections.recordings import runs as recordings
from pipelines.report.sections.residuals import against, residual_charts, telling
from pipelines.report.sections.standstill import worse
from pipelines.report.sections.symbols import terms
from pipelines.report.session import Session

MOST_CANDIDATES = 12
"""In sight; the others unfold."""
FEWEST_VALUES = 20_000
"""Numbers in all charts below which a page is not made smaller: what is large then is no chart."""
STATUS = {
    "explained": ("explained", "good"),
    "partly_explained": ("partly explained", "warn"),
    "unknown_cause": ("cause unknown", "warn"),
    "nothing_missing": ("nothing missing", "good"),
}
HEADLINES = {
    "unknown_cause": "Something is missing that no listed cause explains",
    "nothing_missing": "Nothing is missing that these data could show",
}
TONES = {
    "named": "good",
    "indistinguishable": "warn",
    "unlisted": "warn",
    "absorbed": "",
    "rejected": "",
}


@dataclass(frozen=True)
class Charts:
    """Every chart of a session, thinned to fit one page."""

    hero: Chart | None
    measured: tuple[Chart, ...]
    residuals: tuple[Chart, ...]
    control: tuple[Chart, ...]

    @property
    def all(self) -> tuple[Chart, ...]:
        """All of them, in the page's order."""
        return (
            *((self.hero,) if self.hero else ()),
            *self.measured,
            *self.residuals,
            *self.control,
        )


def charts(session: Session, values: int | None = VALUES) -> Charts:
    """Return the charts of a session, together of so many numbers at most; None for all there
    are."""
    groups = [
        [*torque_charts(session), *angle_charts(session)],
        list(residual_charts(session)),
        list(control_charts(session)),
    ]
    flat = [chart for group in groups for chart in group]
    thin = iter(flat if values is None else thinned_alike(flat, values))
    measured, residual, control = (tuple(next(thin) for _ in group) for group in groups)
    return Charts(_hero(session, residual), measured, residual, control)


def _hero(session: Session, residuals: Sequence[Chart]) -> Chart | None:
    joint = worst_joint(session)
    if joint is None:
        return None
    key = f"residual-{joint.name}-{telling(session, joint).replace('_', '-')}"
    return next((replace(chart, key="verdict") for chart in residuals if chart.key == key), None)


def report(session: Session, title: str | None = None, output: Path | None = None) -> str:
    """Return the page of a session, its charts as thin as it takes to stay below ``LARGEST_BYTES``.

    ``output`` is where it will be written, for the command line that repeats it.
    """
    values = VALUES
    while (
        len((page := _page(session, title, output, values)).encode()) > LARGEST_BYTES
        and values > FEWEST_VALUES
    ):
        values //= 2
    return page


def _page(session: Session, title: str | None, output: Path | None, values: int) -> str:
    drawn, verdict, shown = charts(session, values), session.verdict, animations(session)
    shown_models, taken = models(session), recordings(session)
    quantity = _quantity(session)
    context = {
        "title": title or session.name,
        "machine": machine(session, taken),
        "status": status(verdict),
        "headline": headline(session),
        "verdict": verdict,
        "lead": lead(verdict) if verdict else "",
        "decision": decision(verdict) if verdict else None,
        "faults": faults_in_short(verdict) if verdict else ("", 0),
        "with_causes": _with_causes(verdict) if verdict else "",
        "quantity": quantity,
        "torque_unit": either(joint.unit("torque") for joint in session.joints) or "N·m",
        "terms": terms(session),
        "mask": (verdict or {}).get("scoring", {}).get("mask") or "slow motion",
        "warnings": [*provenance.stale(session), *provenance.changed_settings(session)],
        "tiles": tiles(session),
        "worse": worse(session),
        "falls": falls(verdict) if verdict else [],
        "budget": budget(verdict) if verdict else [],
        "hero": drawn.hero,
        "runs": _runs(session, drawn.measured),
        "residuals": _residuals(session, drawn.residuals),
        "causes": [_cause(cause) for cause in verdict["causes"]] if verdict else [],
        "candidates": _candidates(session),
        "most_candidates": MOST_CANDIDATES,
        "has_baseline": bool(session.baselines),
        "models": shown_models,
        "parameters": side_by_side(shown_models),
        "excitations": excitations(session),
        "recordings": taken,
        "control": _control(verdict) if verdict else None,
        "control_is_compared": "extended" in loops(session),
        "loops": drawn.control,
        "is_leg": drawn_as(session) == "leg",
        "animations": shown,
        "damaged_verdict": session.has_damaged_verdict,
        "unreadable": list(session.unreadable.values()),
        "commands": provenance.commands(session, output, title),
        "settings": indented(provenance.settings(session)),
        "software": provenance.software(session),
        "origins": provenance.origins(session),
        "outside": provenance.outside(session),
    }
    return render("report.html", drawn.all, shown, context, session.artifacts)


def _quantity(session: Session) -> str:
    return either(joint.effort for joint in session.joints) or "torque"


def machine(session: Session, taken: Sequence[Run]) -> str:
    """Return joints, and rig, subject and session of the recordings, in words."""
    joints = " and ".join(joint.name for joint in session.joints)
    about = list(dict.fromkeys(one.about for one in taken if one.about))
    return " · ".join(filter(None, (joints, "; ".join(about[:3]))))


def status(verdict: dict[str, Any] | None) -> dict[str, str]:
    """Return a verdict's status in words, and the tone of its badge."""
    if not verdict:
        return {"words": "not diagnosed", "tone": ""}
    if verdict.get("acquisition_at_fault"):
        return {"words": "acquisition, not physics", "tone": "bad"}
    words, tone = STATUS.get(verdict["status"], (verdict["status"].replace("_", " "), ""))
    return {"words": words, "tone": tone}


def headline(session: Session) -> str:
    """Return what was found, as short as can be."""
    verdict = session.verdict
    if not verdict:
        return "The verdict cannot be read" if session.has_damaged_verdict else "Not diagnosed yet"
    if verdict.get("acquisition_at_fault"):
        return "The recordings are at fault, not the model"
    if verdict["causes"]:
        words = causes_in_words(verdict["causes"])
        return f"The simulation misses {words}"
    findings = verdict.get("findings")
    if verdict["status"] == "unknown_cause" and findings:
        return f"The simulation misses {findings[0]['words']}, and no listed cause explains it"
    return HEADLINES.get(verdict["status"], verdict["status"].replace("_", " "))


def _with_causes(verdict: dict[str, Any]) -> str:
    """Say which model the bars with the causes are of: of causes that are tied, the likeliest is in
    it."""
    which = "likeliest" if any(map(ties_of, verdict["causes"])) else "named"
    return f"with the {which} cause{'s' * (len(verdict['causes']) > 1)}"


@dataclass(frozen=True)
class ShownRun:
    """One run's charts."""

    name: str
    about: str
    charts: tuple[Chart, ...]
    replayed: bool
    models: tuple[str, ...]
    """What the columns of its scores are of."""
    scores: tuple[Score, ...]
    lacks_causes: bool
    """Whether it was simulated without the causes alone."""
    unmoved: str
    """Why; nothing where it could have been."""


def _runs(session: Session, drawn: Sequence[Chart]) -> list[ShownRun]:
    replays = replayed(session)
    names = dict.fromkeys([*run_names(session), *replays])
    return [
        ShownRun(
            name,
            _about_run(session, name),
            tuple(chart for chart in drawn if chart.group == name),
            name in replays,
            tuple(words for _, words in models_of(session).values()),
            tuple(scores(session, name)),
            lacks_causes(session, name),
            unmoved(session, name),
        )
        for name in sorted(names, key=lambda name: "human" not in name)
    ]


def _about_run(session: Session, name: str) -> str:
    if session.residuals is None:
        return ""
    rows = session.residuals.frame
    rows = rows[rows["file"] == name]
    if not len(rows):
        return ""
    kind = {"exo_alone": "nobody in it", "with_human": "with a person"}[rows["run"].iloc[0]]
    return f"{kind}, {digits(float(np.ptp(rows['time_s'])))} s"


@dataclass(frozen=True)
class Predicted:
    """A variable and the share of the error that it predicts."""

    words: str
    before: float
    after: float | None


@dataclass(frozen=True)
class JointResiduals:
    """One joint's residual charts, and what its error depends on."""

    name: str
    charts: tuple[Chart, ...]
    depends: tuple[Predicted, ...]


def _residuals(session: Session, drawn: Sequence[Chart]) -> list[JointResiduals]:
    rows = []
    for joint in session.joints:
        own = tuple(chart for chart in drawn if chart.key.startswith(f"residual-{joint.name}-"))
        if own:
            rows.append(JointResiduals(joint.name, own, tuple(_predicted(session, joint))))
    return rows


def _predicted(session: Session, joint: Joint) -> list[Predicted]:
    verdict = session.verdict or {}
    words = {one.variable: one.title for one in against(session, joint)}
    named = bool(verdict.get("causes"))
    return [
        Predicted(
            words.get(one["variable"], one["variable"].replace("_", " ")),
            one["share_before"],
            one["share_after"] if named else None,
        )
        for one in verdict.get("depends_on", {}).get(joint.name, [])
    ]


def _cause(cause: dict[str, Any]) -> dict[str, Any]:
    return {
        "words": cause_in_words(cause),
        "own": own_values(cause),
        "evidence": cause["evidence"],
        "ties": [
            {
                "words": cause_in_words(tie),
                "probability": tie.get("probability"),
                "why": tie["why"],
                "how": tie["how_to_separate"],
            }
            for tie in ties_of(cause)
        ],
    }


def _candidates(session: Session) -> list[dict[str, Any]]:
    if session.candidates is None:
        return []
    rows = session.candidates.frame.sort_values("rank").to_dict("records")
    labels = {label for row in rows for label in row["causes"]}
    named = next((row for row in rows if row["verdict"] == "named"), None)
    # What another set's zeros would be, one for all runs or each run's own, the table does not
    # tell.
    reasons = dict.fromkeys(
        ("named", "indistinguishable"), shares_in_words(session.verdict or {"causes": []})
    )
    return [
        {
            "rank": row["rank"],
            "is_more": (more := _beyond(row, named)) is not None,
            "words": [
                reasons.get(row["verdict"], {}).get(label) or any_label_in_words(label)
                for label in (row["causes"] if more is None else more)
            ],
            "probability": _likely(row["probability"]),
            "verdict": row["verdict"],
            "tone": TONES.get(row["verdict"], ""),
            "falls": [
                f"{joint.name} {digits(row[joint.column('rmse_before')])} →"
                f" {digits(row[joint.column('rmse_after')])}"
                for joint in session.joints
                if np.isfinite(row[joint.column("rmse_after")])
            ],
            "taken": _taken(row) if more is None or named is None else _gain(session, named, row),
            "reason": labels_in_words(_reason(row["reason"], more or ()), labels),
        }
        for row in rows
    ]


def _beyond(row: dict[Any, Any], named: dict[Any, Any] | None) -> list[str] | None:
    """Return what a set holds beside all that is named; None where it does not hold all of that, or
    nothing more."""
    if named is None or not set(named["causes"]) < set(row["causes"]):
        return None
    return [label for label in row["causes"] if label not in set(named["causes"])]


def _reason(reason: str, more: Sequence[str]) -> str:
    """Return why a set is not named, without its probability, which has a column, and whose reason
    it is."""
    first, _, others = reason.partition("; ")
    sentence = others if first.startswith("its probability is ") else reason
    return sentence.removeprefix(f"{' and '.join(sorted(more))} ")


def _likely(probability: float) -> str:
    """Return a probability; a dash for what was not weighed."""
    if not np.isfinite(probability):
        return "–"
    return f"{probability:.2f}" if probability >= 0.005 else "< 0.01"


def _gain(session: Session, less: dict[Any, Any], more: dict[Any, Any]) -> str:
    """Return what a set gains over a smaller one, at the joint where most."""
    after = [joint.column("rmse_after") for joint in session.joints]
    return digits(max(less[column] - more[column] for column in after))


def _taken(row: dict[Any, Any]) -> str:
    """Return what a set takes of the baseline's error with its interval, which one short run cannot
    have."""
    if not np.isfinite(row["gain_nm"]):
        return "–"
    low, high = row["gain_low_nm"], row["gain_high_nm"]
    interval = f" ({digits(low)} … {digits(high)})" if high > low else " (no interval)"
    return digits(row["gain_nm"]) + interval


def _control(verdict: dict[str, Any]) -> dict[str, Any] | None:
    benefit = verdict.get("control") or {}
    rows = [
        {
            "key": key,
            "words": words,
            "error": {
                joint: 1e3 * value for joint, value in benefit[key]["tracking_rmse_rad"].items()
            },
            "torque": benefit[key]["peak_torque_nm"],
        }
        for key, words in (("without", "rigid body and friction"), ("with", "with the causes"))
        if benefit.get(key) and (key == "without" or verdict["causes"])
    ]
    if not rows:
        return None
    return {
        "run": benefit["run"].replace("_", " "),
        "joints": list(rows[0]["torque"]),
        "rows": rows,
        "settled_s": (benefit.get("controller") or {}).get("settled_after_s"),
    }

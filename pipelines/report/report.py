"""The report of one session: what stands in each of its six parts."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pipelines.contracts import Joint
from pipelines.report import provenance
from pipelines.report.acquisition import runs as recordings
from pipelines.report.animation import animations
from pipelines.report.bars import budget, cause_label, causes_in_words, falls, label_in_words, torque_unit
from pipelines.report.chart import Chart, thinned_alike
from pipelines.report.control import control_charts, loops
from pipelines.report.excitation import excitations
from pipelines.report.measured import (
    Score,
    angle_charts,
    models_of,
    names_of,
    replayed,
    run_names,
    scores,
    torque_charts,
)
from pipelines.report.numbers import digits
from pipelines.report.page import LARGEST_BYTES, VALUES, indented, render
from pipelines.report.parameters import models, side_by_side
from pipelines.report.residual import against, residual_charts, telling
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
    "unknown_cause": "Something is missing that no known cause explains",
    "nothing_missing": "Nothing is missing that these data could show",
}
TONES = {"named": "good", "indistinguishable": "warn", "absorbed": "", "rejected": ""}


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
        return (*((self.hero,) if self.hero else ()), *self.measured, *self.residuals, *self.control)


def charts(session: Session, values: int | None = VALUES) -> Charts:
    """Return the charts of a session, together of so many numbers at most; None for all there are."""
    groups = [
        [*torque_charts(session), *angle_charts(session)],
        list(residual_charts(session)),
        list(control_charts(session)),
    ]
    flat = [chart for group in groups for chart in group]
    thin = iter(flat if values is None else thinned_alike(flat, values))
    measured, left, control = (tuple(next(thin) for _ in group) for group in groups)
    return Charts(_hero(session, left), measured, left, control)


def _hero(session: Session, residuals: Sequence[Chart]) -> Chart | None:
    joint = _worst(session)
    if joint is None:
        return None
    key = f"residual-{joint.name}-{telling(session, joint).replace('_', '-')}"
    return next((replace(chart, key="verdict") for chart in residuals if chart.key == key), None)


def _worst(session: Session) -> Joint | None:
    """Return the joint that the first cause gains most at, or that is furthest above its floor."""
    verdict = session.verdict
    if not verdict:
        return None
    before, floor = verdict["baseline_rmse_nm"], verdict["noise_floor_nm"]
    name = verdict["causes"][0]["gain"].get("joint") if verdict["causes"] else None
    name = name or max(before, key=lambda joint: before[joint] / floor[joint])
    return next((joint for joint in session.joints if joint.name == name), None)


def report(session: Session, title: str | None = None) -> str:
    """Return the page of a session, its charts as thin as it takes to stay below ``LARGEST_BYTES``."""
    values = VALUES
    while len((page := _page(session, title, values)).encode()) > LARGEST_BYTES and values > FEWEST_VALUES:
        values //= 2
    return page


def _page(session: Session, title: str | None, values: int) -> str:
    drawn, verdict, shown = charts(session, values), session.verdict, animations(session)
    quantity = _quantity(session)
    told = {
        "title": title or session.name,
        "machine": machine(session),
        "status": status(verdict),
        "headline": headline(verdict),
        "verdict": verdict,
        "quantity": quantity,
        "warnings": [*provenance.stale(session), *provenance.changed_settings(session)],
        "tiles": _tiles(session, verdict) if verdict else [],
        "falls": falls(verdict) if verdict else [],
        "budget": budget(verdict) if verdict else [],
        "hero": drawn.hero,
        "runs": _runs(session, drawn.measured),
        "residuals": _residuals(session, drawn.residuals),
        "causes": [_cause(cause) for cause in verdict["causes"]] if verdict else [],
        "candidates": _candidates(session),
        "most_candidates": MOST_CANDIDATES,
        "has_baseline": bool(session.baselines),
        "models": models(session),
        "parameters": side_by_side(models(session)),
        "excitations": excitations(session),
        "recordings": recordings(session),
        "control": _control(verdict) if verdict else None,
        "control_is_compared": "extended" in loops(session),
        "loops": drawn.control,
        "is_leg": len(session.joints) == 2,
        "animations": shown,
        "unreadable": session.unreadable,
        "commands": provenance.commands(session),
        "settings": indented(provenance.settings(session)),
        "origins": provenance.origins(session),
    }
    return render("report.html", drawn.all, shown, told, session.artifacts)


def _quantity(session: Session) -> str:
    return names_of(session.joints[0])["torque"] if session.joints else "torque"


def machine(session: Session) -> str:
    """Return joints, rig, subject and session in words."""
    joints = " and ".join(joint.name for joint in session.joints)
    about = list(dict.fromkeys(one.about for one in recordings(session) if one.about))
    return " · ".join(filter(None, (joints, "; ".join(about[:3]))))


def status(verdict: dict[str, Any] | None) -> dict[str, str]:
    """Return a verdict's status in words, and the tone of its badge."""
    if not verdict:
        return {"words": "not diagnosed", "tone": ""}
    if is_spoilt(verdict):
        return {"words": "acquisition, not physics", "tone": "bad"}
    words, tone = STATUS.get(verdict["status"], (verdict["status"].replace("_", " "), ""))
    return {"words": words, "tone": tone}


def is_spoilt(verdict: dict[str, Any]) -> bool:
    """Tell whether acquisition was at fault, so that no physics is blamed."""
    return verdict["summary"].startswith("Acquisition, not physics")


def headline(verdict: dict[str, Any] | None) -> str:
    """Return what was found, as short as can be."""
    if not verdict:
        return "Not diagnosed yet"
    if is_spoilt(verdict):
        return "The recordings are at fault, not the model"
    if verdict["causes"]:
        words = causes_in_words(verdict["causes"])
        return f"The simulation misses {words}"
    return HEADLINES.get(verdict["status"], verdict["status"].replace("_", " "))


@dataclass(frozen=True)
class Tile:
    """One number of the first screen."""

    title: str
    big: str
    unit: str
    small: str


def _tiles(session: Session, verdict: dict[str, Any]) -> list[Tile]:
    """Return what a hurried reader wants: how sure, how much, how much is left, and what simulations make of it."""
    tiles = [tile for cause in verdict["causes"][:2] for tile in _cause_tiles(verdict, cause)]
    for fall in falls(verdict):
        if fall.unexplained is not None:
            after = "" if fall.after is None else f" → {digits(fall.after / fall.floor)}"
            big = f"{digits(fall.before / fall.floor)}{after}"
            tiles.append(Tile(f"{fall.joint} error", big, "× floor", "1 would be noise alone"))
    return [*tiles, *_simulation_tiles(session, verdict), *_loop_tiles(session)]


def _cause_tiles(verdict: dict[str, Any], cause: dict[str, Any]) -> list[Tile]:
    gain, (low, high) = cause["gain"]["rmse_reduction_nm"], cause["gain"]["ci95"]
    joint = cause["gain"].get("joint") or cause["joint"]
    unit, ties = torque_unit(verdict, joint), len(cause["indistinguishable_from"])
    words = label_in_words(cause_label(cause))
    return [
        Tile(
            "probability" + (", with its ties" if ties else ""),
            f"{100 * cause['probability']:.0f}",
            "%",
            words + (f", or one of {ties} that these data cannot tell from it" if ties else ""),
        ),
        Tile(
            f"gain at the {joint}",
            digits(-gain),
            unit,
            f"of {digits(verdict['baseline_rmse_nm'][joint])} {unit}; 95 %: {digits(-high)} … {digits(-low)}",
        ),
    ]


def _simulation_tiles(session: Session, verdict: dict[str, Any]) -> list[Tile]:
    """Return how far simulations of a second stray, at the joint that matters most."""
    joint = _worst(session)
    before = verdict["baseline_simulation_rmse_rad"].get(joint.name) if joint else None
    if not joint or before is None:
        return []
    after = verdict["extended_simulation_rmse_rad"][joint.name] if verdict["causes"] else None
    big = digits(1e3 * before) + ("" if after is None else f" → {digits(1e3 * after)}")
    return [
        Tile(f"{joint.name}, simulated for 1 s", big, f"m{joint.unit('angle')}", "rms, driven by what was recorded")
    ]


def _loop_tiles(session: Session) -> list[Tile]:
    """Return how far the drives' simulated torque is off, of the run where naming the causes gains most."""
    joint, key = _worst(session), "closed_loop_rmse_nm"
    pairs = [
        [one[model].metadata[key][joint.name] for model in ("baseline", "extended")]
        for one in replayed(session, "drives").values()
        if joint and len(one) == 2 and all(joint.name in made.metadata.get(key, {}) for made in one.values())
    ]
    if not joint or not pairs:
        return []
    before, after = max(pairs, key=lambda pair: pair[0] - pair[1])
    small = f"rms error of the simulated {names_of(joint)['torque']}"
    return [
        Tile(f"{joint.name}, in the drives' loop", f"{digits(before)} → {digits(after)}", joint.unit("torque"), small)
    ]


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
class Foretold:
    """A variable and the share of the error that it foretells."""

    words: str
    before: float
    after: float | None


@dataclass(frozen=True)
class JointResiduals:
    """One joint's residual charts, and what its error goes with."""

    name: str
    charts: tuple[Chart, ...]
    depends: tuple[Foretold, ...]


def _residuals(session: Session, drawn: Sequence[Chart]) -> list[JointResiduals]:
    found = []
    for joint in session.joints:
        own = tuple(chart for chart in drawn if chart.key.startswith(f"residual-{joint.name}-"))
        if own:
            found.append(JointResiduals(joint.name, own, tuple(_foretold(session, joint))))
    return found


def _foretold(session: Session, joint: Joint) -> list[Foretold]:
    verdict = session.verdict or {}
    words = {one.variable: one.title for one in against(session, joint)}
    named = bool(verdict.get("causes"))
    return [
        Foretold(
            words.get(one["variable"], one["variable"].replace("_", " ")),
            one["share_before"],
            one["share_after"] if named else None,
        )
        for one in verdict.get("depends_on", {}).get(joint.name, [])
    ]


def _cause(cause: dict[str, Any]) -> dict[str, Any]:
    return {
        "words": label_in_words(cause_label(cause)),
        "evidence": cause["evidence"],
        "ties": [
            {
                "words": label_in_words(cause_label(tie)),
                "probability": tie.get("probability"),
                "why": tie["why"],
                "how": tie["how_to_separate"],
            }
            for tie in cause["indistinguishable_from"]
        ],
    }


def _candidates(session: Session) -> list[dict[str, Any]]:
    if session.candidates is None:
        return []
    rows = session.candidates.frame.sort_values("rank").to_dict("records")
    return [
        {
            "rank": row["rank"],
            "words": [label_in_words(label) for label in row["causes"]],
            "verdict": row["verdict"],
            "tone": TONES.get(row["verdict"], ""),
            "falls": [
                f"{joint.name} {digits(row[joint.column('rmse_before')])} → {digits(row[joint.column('rmse_after')])}"
                for joint in session.joints
                if np.isfinite(row[joint.column("rmse_after")])
            ],
            "gain": (
                f"{digits(row['gain_nm'])} ({digits(row['gain_low_nm'])} … {digits(row['gain_high_nm'])})"
                if np.isfinite(row["gain_nm"])
                else "–"
            ),
            "reason": row["reason"],
        }
        for row in rows
    ]


def _control(verdict: dict[str, Any]) -> dict[str, Any] | None:
    told = verdict.get("control") or {}
    rows = [
        {
            "key": key,
            "words": words,
            "error": {joint: 1e3 * value for joint, value in told[key]["tracking_rmse_rad"].items()},
            "torque": told[key]["peak_torque_nm"],
        }
        for key, words in (("without", "without the causes"), ("with", "with the causes"))
        if told.get(key)
    ]
    if not rows:
        return None
    return {"run": told["run"].replace("_", " "), "joints": list(rows[0]["torque"]), "rows": rows}

"""The comparison of two sessions: verdicts, errors, settings, and changes of parameters."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import hypot
from typing import Any

from pipelines.contracts.joints import in_words
from pipelines.contracts.verdict import Cause
from pipelines.errors import InputError
from pipelines.report.html.page import render
from pipelines.report.sections.error_budget import torque_unit
from pipelines.report.sections.headline import headline, lead, machine, status
from pipelines.report.sections.parameters import Estimate, estimates
from pipelines.report.sections.settings_diff import SettingDifference, settings_diff
from pipelines.report.session import Session
from pipelines.wording.causes import any_label_in_words, cause_in_words
from pipelines.wording.numbers import digits


@dataclass(frozen=True)
class Change:
    """One number of both sessions."""

    words: str
    first: Estimate
    second: Estimate

    @property
    def difference(self) -> float:
        """The second less the first."""
        return self.second.value - self.first.value

    @property
    def half(self) -> float | None:
        """Half the 95 % interval of the difference of independent estimates; None without one.

        Values that differ from run to run have none, because two first runs may differ. The errors
        of independent sessions add in squares, and so do the half widths.
        """
        per_run = self.first.each_run or self.second.each_run
        if per_run or self.first.half is None or self.second.half is None:
            return None
        return hypot(self.first.half, self.second.half)

    @property
    def is_beyond(self) -> bool | None:
        """Whether the difference's interval excludes zero; None without an interval."""
        # A half width of zero is of assumed values, about which the data say nothing.
        return None if not self.half else abs(self.difference) > self.half


def changes(first: Sequence[Estimate], second: Sequence[Estimate]) -> list[Change]:
    """Return the parameters of both, in the order of the first."""
    others = {one.key: one for one in second}
    return [Change(one.words, one, others[one.key]) for one in first if one.key in others]


@dataclass(frozen=True)
class Comparison:
    """The page, and its main results for the terminal."""

    text: str
    changed: int
    judged: int
    headline: str
    """The changes, most important first."""
    errors: list[str]
    """One line per joint and model: its errors and noise floors."""
    settings: list[SettingDifference]


def titles_of(first: Session, second: Session) -> tuple[str, str]:
    """Return the names of the sessions' folders, with as many parents as make them differ."""
    paths = [session.folders[0].resolve() for session in (first, second)]
    names = [path.name for path in paths]
    # Parents are added until the names differ, as in a/diagnosed and b/diagnosed.
    for path_a, path_b in zip(*(path.parents for path in paths), strict=False):
        if names[0] != names[1]:
            break
        names = [f"{path_a.name}/{names[0]}", f"{path_b.name}/{names[1]}"]
    return names[0], names[1]


def compare(first: Session, second: Session, titles: tuple[str, str]) -> Comparison:
    """Compare two sessions of one machine.

    Raises
    ------
    InputError
        If their machines or the units of their parameters differ.
    """
    pair = (first, second)
    _refuse_different_machines(pair, titles)
    models = list(_models(pair))
    # The last model has the most parameters; those of the other are not counted twice.
    changed = [change.is_beyond for change in models[-1]["changes"]] if models else []
    beyond, judged = changed.count(True), len(changed) - changed.count(None)
    result, rows = _change_in_words(pair, beyond, judged), _errors_and_floors(pair)
    settings = settings_diff(first, second)
    context = {
        "headline": result,
        "titles": titles,
        "machines": [machine(session) for session in pair],
        "verdicts": [session.verdict for session in pair],
        "leads": [lead(session.verdict) if session.verdict else "" for session in pair],
        "unreadable": [error for session in pair for error in session.unreadable.values()],
        "statuses": [status(session.verdict) for session in pair],
        "headlines": [headline(session) for session in pair],
        "models": models,
        "settings": settings,
        "errors_and_floors": rows,
        "judged": judged,
        "causes": _causes(pair),
    }
    text = render("compare.html", (), (), context, (*first.artifacts, *second.artifacts))
    errors = [row.words for row in rows]
    return Comparison(text, beyond, judged, result, errors, settings)


def _change_in_words(pair: tuple[Session, Session], beyond: int, judged: int) -> str:
    """Return the headline: the verdict's change before that of the parameters."""
    if beyond:
        of_parameters = f"{beyond} of {judged} parameters changed beyond their intervals"
    elif judged:
        of_parameters = "no parameter changed beyond its interval"
    else:
        of_parameters = "nothing that both sessions have can be compared"
    of_verdict = _verdict_change_in_words(pair)
    sentence = f"{of_verdict}; {of_parameters}" if of_verdict else of_parameters
    return sentence[:1].upper() + sentence[1:]


def _verdict_change_in_words(pair: tuple[Session, Session]) -> str:
    """Return the verdict's change; empty if there is none, or a session has no verdict."""
    if not all(session.verdict for session in pair):
        return ""
    first, second = (status(session.verdict)["words"] for session in pair)
    if first != second:
        return f"the verdict went from {first} to {second}"
    one, other = ({cause.label for cause in session.causes} for session in pair)
    return "" if one == other else "other causes are named"


@dataclass(frozen=True)
class ErrorAndFloor:
    """One error of a joint in both sessions, with each session's noise floor."""

    joint: str
    model: str
    unit: str
    values: tuple[float, float]
    floors: tuple[float, float]

    @property
    def highest(self) -> float:
        """The largest error or floor."""
        return max(*self.values, *self.floors)

    @property
    def words(self) -> str:
        """Errors and floors in one line."""
        # Also in floors, since the floors of two sessions may differ with their sensors.
        parts = [
            f"{digits(v)} {self.unit}, {digits(v / f)} times the floor of {digits(f)} {self.unit}"
            for v, f in zip(self.values, self.floors, strict=True)
        ]
        return f"{self.joint}, {self.model}: {parts[0]} → {parts[1]}"


def _errors_and_floors(pair: tuple[Session, Session]) -> list[ErrorAndFloor]:
    """Return each joint's error without the causes and, if any is named, with them."""
    first, second = (session.verdict for session in pair)
    if not first or not second:
        return []
    kinds = [("rigid body and friction", "baseline_rmse_nm")]
    if first.causes or second.causes:
        kinds.append(("with the causes that each names", "extended_rmse_nm"))
    rows = []
    for joint in first.baseline_rmse_nm:
        unit = torque_unit(first, joint)
        floors = (first.noise_floor_nm[joint], second.noise_floor_nm[joint])
        for words, key in kinds:
            # The refusal of different machines guarantees that both have this joint.
            errors = (getattr(first, key)[joint], getattr(second, key)[joint])
            rows.append(ErrorAndFloor(joint, words, unit, errors, floors))
    return rows


def _refuse_different_machines(pair: tuple[Session, Session], titles: tuple[str, str]) -> None:
    """Refuse sessions whose machines differ in their joints' names or kinds, or their mechanism."""
    descriptions = {"": lambda session: in_words(session.joints), "mechanism ": _mechanism}
    # Equal joints are not enough: a leg that lies level has other parameters than one that hangs.
    for prefix, description in descriptions.items():
        one, other = map(description, pair)
        if one and other and one != other:
            raise InputError(
                f"{titles[0]} is of another machine than {titles[1]} ({prefix}{one}, and"
                f" {prefix}{other}). Compare two sessions of one machine"
            )


def _mechanism(session: Session) -> str | None:
    """Return the mechanism's name in a session's models; None if they have none."""
    names = (one.metadata.get("mechanism") for one in session.of_kind("parameters"))
    return next((name for name in names if isinstance(name, str)), None)


def _models(pair: tuple[Session, Session]) -> Iterator[dict[str, Any]]:
    """Yield the changes of each model that both sessions have, parameter by parameter."""
    kinds = {
        "Rigid body and friction": [next(iter(session.baselines), None) for session in pair],
        "With the causes that each names": [session.extended for session in pair],
    }
    first, second = pair
    for title, (one, other) in kinds.items():
        if one and other:
            a, b = estimates(first.table(one)), estimates(second.table(other))
            files = (first.shown(one.path), second.shown(other.path))
            only, changed = (_only(first, a, b), _only(second, b, a)), changes(a, b)
            _refuse_different_units(changed, files)
            yield {"title": title, "files": files, "changes": changed, "only": only}


def _refuse_different_units(changes: list[Change], files: tuple[str, str]) -> None:
    for change in changes:
        if change.first.unit != change.second.unit:
            raise InputError(
                f"{files[0]} and {files[1]}: {change.words} is in {change.first.unit} and in"
                f" {change.second.unit}, expected one unit. Compare two sessions of one machine"
            )


def _only(session: Session, own: list[Estimate], others: list[Estimate]) -> list[str]:
    """Return the parameters of one session only, in words, with its named causes."""
    named = {cause.label for cause in session.causes}
    known = {other.key for other in others}
    results = []
    for one in (one for one in own if one.key not in known):
        label = f"{one.effect}@{one.joint}" if one.joint else one.effect
        cause = f" of {any_label_in_words(label)}, which it names" if label in named else ""
        results.append(f"{one.words}{cause}")
    return results


def _causes(pair: tuple[Session, Session]) -> list[dict[str, Any]]:
    """Return the causes that either verdict names, with probability and gain in each."""
    named = [{cause.label: cause for cause in session.causes} for session in pair]
    rows = []
    for label in named[0] | named[1]:
        in_each = [causes.get(label) for causes in named]
        words = dict.fromkeys(cause_in_words(cause) for cause in in_each if cause)
        cells = [_cause_cell(*one) for one in zip(pair, in_each, strict=True)]
        # A cause of one label may be worded differently, where only one session has it per run.
        rows.append({"words": " / ".join(words), "cells": cells})
    return rows


def _cause_cell(session: Session, cause: Cause | None) -> dict[str, Any] | None:
    if cause is None:
        return None
    assert session.verdict
    low, high = cause.gain.ci95
    return {
        "probability": cause.probability,
        "gain": cause.gain.rmse_reduction_nm,
        "low": low,
        "high": high,
        "unit": torque_unit(session.verdict, cause.gain.joint),
    }

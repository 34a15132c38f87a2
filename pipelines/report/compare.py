"""Two sessions side by side: what changed, beyond what their intervals allow for."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import hypot
from typing import Any

from pipelines.errors import InputError
from pipelines.report.numbers import digits
from pipelines.report.page import render
from pipelines.report.report import headline, machine, status
from pipelines.report.sections.error_budget import any_label_in_words, cause_in_words, torque_unit
from pipelines.report.sections.lead import lead
from pipelines.report.sections.parameters import Estimate, estimates
from pipelines.report.sections.recordings import runs
from pipelines.report.sections.settings_diff import SettingApart, settings_apart
from pipelines.report.session import Artifact, Session
from pipelines.wording.label import cause_label


@dataclass(frozen=True)
class Change:
    """One number of both sessions."""

    words: str
    unit: str
    first: Estimate
    second: Estimate

    @property
    def difference(self) -> float:
        """The second less the first."""
        return self.second.value - self.first.value

    @property
    def half(self) -> float | None:
        """Half the 95 % interval of the difference of independent estimates; None where one of them
        has none.

        Nor is there one of values that are each run's own: two first runs need not have the same.

        Errors of independent sessions add in squares, and so do the intervals' halves: each is its
        standard error times the critical value that its session's scatter asks for.
        """
        own = self.first.each_run or self.second.each_run
        if own or self.first.half is None or self.second.half is None:
            return None
        return hypot(self.first.half, self.second.half)

    @property
    def is_beyond(self) -> bool | None:
        """Whether the difference's interval leaves out zero; None where there is none."""
        return None if not self.half else abs(self.difference) > self.half


@dataclass(frozen=True)
class ModelChanges:
    """One model of both sessions, parameter by parameter."""

    title: str
    files: tuple[str, str]
    changes: tuple[Change, ...]
    only: tuple[tuple[str, ...], tuple[str, ...]]
    """Parameters that only the one or the other session has."""

    @property
    def beyond(self) -> int:
        """How many have changed beyond their intervals."""
        return sum(bool(change.is_beyond) for change in self.changes)

    @property
    def judged(self) -> int:
        """How many could have."""
        return sum(change.is_beyond is not None for change in self.changes)


def changes(first: Sequence[Estimate], second: Sequence[Estimate]) -> list[Change]:
    """Return the parameters that both have, in the order of the first."""
    others = {one.key: one for one in second}
    return [Change(one.words, one.unit, one, others[one.key]) for one in first if one.key in others]


@dataclass(frozen=True)
class Compared:
    """The page, and the count that stands on top of it."""

    text: str
    changed: int
    judged: int
    headline: str
    """What changed, most telling first."""
    errors: tuple[str, ...]
    """Each joint's errors beside the floors, as a line."""
    settings: tuple[SettingApart, ...]


def titles_of(first: Session, second: Session) -> tuple[str, str]:
    """Return what the sessions are called: their folders, as far up as it takes to tell them
    apart."""
    paths = [session.folders[0].resolve() for session in (first, second)]
    names = [path.name for path in paths]
    for path_a, path_b in zip(*(path.parents for path in paths), strict=False):
        if names[0] != names[1]:
            break
        names = [f"{path_a.name}/{names[0]}", f"{path_b.name}/{names[1]}"]
    return names[0], names[1]


def compare(first: Session, second: Session, titles: tuple[str, str]) -> Compared:
    """Lay two sessions side by side.

    Raises
    ------
    InputError
        Where they are of different machines, whose numbers have nothing to do with each other.
    """
    pair = (first, second)
    refuse_different_machines(pair, titles)
    models = list(_models(pair))
    refuse_different_units(models)
    context: dict[str, Any] = {
        "titles": titles,
        "machines": [machine(session, runs(session)) for session in pair],
        "verdicts": [session.verdict for session in pair],
        "leads": [lead(session.verdict) if session.verdict else "" for session in pair],
        "unreadable": [trouble for session in pair for trouble in session.unreadable.values()],
        "statuses": [status(session.verdict) for session in pair],
        "headlines": [headline(session) for session in pair],
        "models": models,
        "settings": settings_apart(first, second),
        "beside_floor": _next_to_floor(pair),
        # A parameter that both models have is counted once, in the one that is told last and knows
        # most.
        "beyond": models[-1].beyond if models else 0,
        "judged": models[-1].judged if models else 0,
        "causes": _causes(pair),
        "errors": _errors(pair),
    }
    context["headline"] = _what_changed(pair, context["beyond"], context["judged"])
    text = render("compare.html", (), (), context, (*first.artifacts, *second.artifacts))
    lines = tuple(row.words for row in context["beside_floor"])
    return Compared(
        text,
        context["beyond"],
        context["judged"],
        context["headline"],
        lines,
        tuple(context["settings"]),
    )


def _what_changed(pair: tuple[Session, Session], beyond: int, judged: int) -> str:
    """Return the headline: the verdict's change before that of the parameters."""
    of_parameters = (
        f"{beyond} of {judged} parameters changed beyond their intervals"
        if beyond
        else "no parameter changed beyond its interval"
        if judged
        else "nothing that both sessions have can be compared"
    )
    of_verdict = _verdict_changed(pair)
    sentence = f"{of_verdict}; {of_parameters}" if of_verdict else of_parameters
    return sentence[:1].upper() + sentence[1:]


def _verdict_changed(pair: tuple[Session, Session]) -> str:
    """Say how the verdict changed; nothing where it did not, or one of the sessions has none."""
    if not all(session.verdict for session in pair):
        return ""
    first, second = (status(session.verdict)["words"] for session in pair)
    if first != second:
        return f"the verdict went from {first} to {second}"
    one, other = (
        {cause_label(cause) for cause in (session.verdict or {})["causes"]} for session in pair
    )
    return "" if one == other else "other causes are named"


@dataclass(frozen=True)
class NextToFloor:
    """One error of a joint in both sessions, each beside its session's floor."""

    joint: str
    model: str
    unit: str
    values: tuple[float, float]
    floors: tuple[float, float]

    @property
    def highest(self) -> float:
        """The largest of the four."""
        return max(*self.values, *self.floors)

    @property
    def words(self) -> str:
        """Say it in a line."""
        parts = [
            f"{digits(v)} {self.unit}, {digits(v / f)} times the floor of {digits(f)} {self.unit}"
            for v, f in zip(self.values, self.floors, strict=True)
        ]
        return f"{self.joint}, {self.model}: {parts[0]} → {parts[1]}"


def _next_to_floor(pair: tuple[Session, Session]) -> list[NextToFloor]:
    """Return each joint's error without causes and, where either names any, with them."""
    first, second = (session.verdict for session in pair)
    if not first or not second:
        return []
    kinds = [("rigid body and friction", "baseline_rmse_nm")]
    if first["causes"] or second["causes"]:
        kinds.append(("with what each names", "extended_rmse_nm"))
    return [
        NextToFloor(
            joint,
            words,
            torque_unit(first, joint),
            (first[key][joint], second[key][joint]),
            (first["noise_floor_nm"][joint], second["noise_floor_nm"][joint]),
        )
        for joint in first["baseline_rmse_nm"]
        for words, key in kinds
    ]


def refuse_different_machines(pair: tuple[Session, Session], titles: tuple[str, str]) -> None:
    """Refuse sessions whose machines differ in their joints' names or kinds, or in how these are
    put together."""
    for what, description in (("", _joints_in_words), ("mechanism ", _mechanism)):
        one, other = (description(session) for session in pair)
        if one and other and one != other:
            raise InputError(
                f"{titles[0]} is of another machine than {titles[1]} ({what}{one}, and"
                f" {what}{other}), expected two sessions of one machine; compare those"
            )


def _joints_in_words(session: Session) -> str:
    return ", ".join(f"{joint.name} ({joint.kind})" for joint in session.joints)


def _mechanism(session: Session) -> str | None:
    """Return the name of the mechanism that a session's first model says; None where none does."""
    names = (one.metadata.get("mechanism") for one in session.of_kind("parameters"))
    return next((name for name in names if isinstance(name, str)), None)


def refuse_different_units(models: Iterable[ModelChanges]) -> None:
    """Refuse a parameter that has one unit here and another there: a difference would mean
    nothing."""
    for model in models:
        for change in model.changes:
            if change.first.unit != change.second.unit:
                raise InputError(
                    f"{model.files[0]} and {model.files[1]}: {change.words} is in"
                    f" {change.first.unit} and in {change.second.unit}, expected one unit; compare"
                    " sessions of one machine"
                )


def _models(pair: tuple[Session, Session]) -> Iterable[ModelChanges]:
    first, second = pair
    kinds = (
        ("Rigid body and friction", [next(iter(session.baselines), None) for session in pair]),
        ("With what each names", [session.extended for session in pair]),
    )
    for title, (one, other) in kinds:
        if one and other:
            yield _model(title, first, one, second, other)


def _model(
    title: str, first: Session, one: Artifact, second: Session, other: Artifact
) -> ModelChanges:
    a, b = estimates(first.table(one)), estimates(second.table(other))
    keys = ({e.key for e in a}, {e.key for e in b})
    return ModelChanges(
        title,
        (first.shown(one.path), second.shown(other.path)),
        tuple(changes(a, b)),
        (
            _only(first, [e for e in a if e.key not in keys[1]]),
            _only(second, [e for e in b if e.key not in keys[0]]),
        ),
    )


def _only(session: Session, alone: Sequence[Estimate]) -> tuple[str, ...]:
    """Return the parameters that a session has alone, those of the causes that it names as such."""
    named = {cause_label(cause) for cause in (session.verdict or {}).get("causes", [])}
    return tuple(
        (
            f"{e.words} of {any_label_in_words(label)}, which it names"
            if (label := _label(e)) in named
            else e.words
        )
        for e in alone
    )


def _label(estimate: Estimate) -> str:
    return f"{estimate.effect}@{estimate.joint}" if estimate.joint else estimate.effect


def _causes(pair: tuple[Session, Session]) -> list[dict[str, Any]]:
    """Return every cause that either verdict names, with what each says of it."""
    named = [
        {cause_label(cause): cause for cause in (session.verdict or {}).get("causes", [])}
        for session in pair
    ]
    return [
        {
            "words": " / ".join(
                dict.fromkeys(cause_in_words(causes[label]) for causes in named if label in causes)
            ),
            "cells": [
                _cause_cell(session, causes.get(label))
                for session, causes in zip(pair, named, strict=True)
            ],
        }
        for label in dict.fromkeys(label for causes in named for label in causes)
    ]


def _cause_cell(session: Session, cause: dict[str, Any] | None) -> dict[str, Any] | None:
    if cause is None:
        return None
    assert session.verdict
    low, high = cause["gain"]["ci95"]
    return {
        "probability": cause["probability"],
        "gain": cause["gain"]["rmse_reduction_nm"],
        "low": low,
        "high": high,
        "unit": torque_unit(session.verdict, cause["gain"].get("joint") or cause["joint"]),
    }


def _errors(pair: tuple[Session, Session]) -> list[tuple[str, list[NextToFloor]]]:
    """Return for each error, without causes and with them, a pair of bars for each joint."""
    rows = _next_to_floor(pair)
    models = dict.fromkeys(row.model for row in rows)
    return [
        (model[:1].upper() + model[1:], [row for row in rows if row.model == model])
        for model in models
    ]

"""Rivals: causes, unlisted laws, or none, between which an experiment is to decide."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pipelines.contracts.verdict import Verdict
from pipelines.effects import Effect
from pipelines.errors import InputError, about
from pipelines.investigation.doubt import CLOSE, doubt_of
from pipelines.mechanics.machine import Machine
from pipelines.model import Term, term_from
from pipelines.wording.label import NOTHING, cause_at
from pipelines.wording.law import ACROSS_JOINTS, LAW, LAWS, UNLISTED, kind_and_joint, law_label

SETTING = "--separate"


@dataclass(frozen=True)
class Rival:
    """A cause, how probable it is before the experiment, and what a diagnosis fitted."""

    effect: Effect | None
    """None for an unlisted law, and for the rival that nothing is missing."""
    probability: float
    """Of the rivals together at most one; the rest is that it is none of them."""
    term: Term | None = None
    """As a diagnosis fitted it."""
    law: str | None = None
    """Label of an unlisted law."""

    @property
    def label(self) -> str:
        """``effect@joint``, ``law:kind@joint``, or ``nothing``."""
        return self.effect.label if self.effect else self.law or NOTHING

    @property
    def is_nothing(self) -> bool:
        """Whether it is the rival that nothing is missing."""
        return self.label == NOTHING


def effects_of(rivals: Sequence[Rival]) -> list[Effect]:
    """Return the effects of the rivals that are causes."""
    return [one.effect for one in rivals if one.effect]


def rivals_named(labels: Sequence[str], machine: Machine) -> list[Rival]:
    """Return equally probable rivals.

    Parameters
    ----------
    labels : sequence of str
        ``effect@joint``, or ``effect`` of a whole machine.
    machine : Machine
        That has them.

    Raises
    ------
    InputError
        Where there are fewer than two, one twice, or one that the machine cannot have.
    """
    if len(labels) < 2 or len(set(labels)) < len(labels):
        raise InputError(
            f"{SETTING}: found {', '.join(labels) or 'no cause'}, expected two different causes or"
            " more, each as EFFECT@JOINT; `exoid effects` lists them"
        )
    effects = [cause_at(label, machine, SETTING) for label in labels]
    return [Rival(effect, 1.0 / len(effects)) for effect in effects]


def rivals_in_verdict(verdict: Verdict, file: Path, machine: Machine) -> list[Rival]:
    """Return the rivals between which a diagnosis did not decide, with its probabilities.

    They are those of the most probable finding in which no cause has ``DECIDED``. Where it may be
    that nothing is missing, or an unlisted law, that is a rival, too.

    Parameters
    ----------
    verdict : Verdict
        What ``exoid diagnose`` wrote.
    file : Path
        Its file, for messages.
    machine : Machine
        That was diagnosed.

    Raises
    ------
    InputError
        Where it leaves no choice, in words.
    ContractError
        Where a cause has values that it cannot have.
    """
    _refuse_unknown_laws(verdict, file, machine)
    doubt = doubt_of(verdict)
    if not doubt.probabilities:
        raise InputError(
            f"{file}: leaves no choice of causes, which a motion could decide"
            f" ({doubt.words}); `exoid design {SETTING}` takes any causes"
        )
    # Values that differ from run to run are no value of the next one.
    fitted = {
        cause.label: {p.name: p.value for p in cause.parameters}
        for cause in verdict.causes
        if not cause.per_run
    }
    # Rivals exclude each other. Probabilities of those that a few sets have together exceed one.
    total = max(1.0, sum(doubt.probabilities.values()))
    rivals = []
    for label, unscaled in doubt.probabilities.items():
        probability = unscaled / total
        if label == NOTHING or label.startswith(LAW):
            rivals.append(Rival(None, probability, law=None if label == NOTHING else label))
            continue
        effect = cause_at(label, machine, str(file))
        values = fitted.get(label)
        with about(file):
            term = term_from(effect, values) if values else None
        rivals.append(Rival(term.effect if term else effect, probability, term))
    # Without a fitted cause it is not known which torque a law has.
    is_known = any(rival.term for rival in rivals)
    return [rival for rival in rivals if is_known or not rival.law]


def _refuse_unknown_laws(verdict: Verdict, file: Path, machine: Machine) -> None:
    """Refuse a law that the machine cannot have.

    It has no torque, so that it would count as a rival that each motion excludes.

    Raises
    ------
    InputError
        With its label, where it is probable enough to be a rival.
    """
    laws = verdict.posterior.laws if verdict.posterior else {}
    joints = [joint.name for joint in machine.joints]
    for label in (label for label, p in laws.items() if p >= CLOSE):
        kind, joint = kind_and_joint(label)
        # Its name alone is that of a listed cause's family, and no motion is planned for it.
        if kind.startswith(UNLISTED):
            continue
        is_place = joint is None if kind == ACROSS_JOINTS else joint in joints
        if kind not in LAWS or not is_place or label != law_label(kind, joint):
            raise InputError(
                f"{file}: posterior.laws: found {label}, expected a law of {' or '.join(joints)},"
                f" such as {law_label('angle', joints[0])}; run `exoid diagnose` again"
            )

"""A cause's label, ``effect@joint`` (see ``Effect.label``), its effect, and its wording."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from pipelines.contracts.joints import the
from pipelines.effects import EFFECTS, Effect
from pipelines.errors import InputError, about
from pipelines.mechanics.machine import Machine
from pipelines.model import BASELINE, effect_named
from pipelines.wording.law import LAW, law_in_words

if TYPE_CHECKING:
    from pipelines.contracts.verdict import Cause, Tie

NOTHING = "nothing"
"""In place of a cause's label: that nothing is missing."""
SHARES = {
    "noise_floor": "noise floor",
    "repeatable_unexplained": "unexplained, repeats every period",
    "not_repeatable": "unexplained, does not repeat",
    "unexplained": "unexplained",
}
"""Shares of the verdict's ``error_budget`` that are no cause, in words."""


def effect_labelled(label: str) -> Effect:
    """Return the effect that ``cogging@knee`` is the label of."""
    name, _, joint = label.partition("@")
    return effect_named(name)(joint=joint or None)


def effect_at(
    label: str, machine: Machine, fits: Callable[[type[Effect]], bool], setting: str, why: str = ""
) -> Effect:
    """Return the effect of a label at a machine, if it ``fits`` a ``setting``.

    ``why`` completes the message where it does not.

    Raises
    ------
    InputError
        Where there is none of this name or at this joint, or it does not fit.
    """
    with about(setting):
        effect = effect_labelled(label)
    if fits(type(effect)) and effect.joint in effect.possible(machine):
        return type(effect)(joint=effect.joint, on=machine)
    can_be = [
        one(joint=place, on=machine)
        for one in EFFECTS
        if fits(one)
        for place in one.possible(machine)
    ]
    # The same effect at another joint is the likeliest correction; without one, all effects.
    expected = [one.label for one in can_be if one.name == effect.name] or [
        one.label for one in can_be
    ]
    raise InputError(
        f"{setting}: found {label}, expected {' or '.join(expected) or 'nothing'}"
        f"{f' ({why})' if why else ''}; correct it or leave it out"
    )


def cause_at(label: str, machine: Machine, setting: str) -> Effect:
    """Return the effect of a label at a machine, if a diagnosis could name it as a cause.

    Raises
    ------
    InputError
        Where there is none of this name or at this joint, or every model has it.
    """
    with about(setting):
        effect = effect_labelled(label)
    if effect.name in BASELINE:
        raise InputError(
            f"{setting}: found {label}, which every model has; name a cause that `exoid effects`"
            " lists"
        )
    return effect_at(label, machine, _is_cause, setting)


def _is_cause(effect: type[Effect]) -> bool:
    return effect.name not in BASELINE


def effect_of_cause(cause: "Cause | Tie") -> Effect:
    """Return the effect of a verdict's cause, or of a rival that is tied with one."""
    effect = effect_named(cause.effect)
    return effect(joint=cause.joint, each_run=bool(effect.may_differ and cause.per_run))


def number(machine: Machine, torque: float) -> str:
    """Return a torque or force at a joint of a machine as text.

    Parameters
    ----------
    machine : Machine
        Hundredths of a newton metre do for an exoskeleton.
    torque : float
        N·m or N.
    """
    return f"{torque:.2f}" if machine.is_exoskeleton else f"{torque:.3g}"


def amount(machine: Machine, joint: str, torque: float) -> str:
    """Return a torque or force at a joint with its unit.

    Parameters
    ----------
    machine : Machine
        The machine.
    joint : str
        Name of the joint.
    torque : float
        N·m or N.
    """
    return f"{number(machine, torque)} {machine.joint(joint).unit('torque')}"


def title_in_words(effect: Effect) -> str:
    """Return an effect's title as it stands within a sentence."""
    # The capital of people's names stays.
    is_name = effect.title.startswith(("Coulomb", "Stribeck"))
    return effect.title if is_name else effect.title.lower()


def in_words(effect: Effect) -> str:
    """Return an effect and where it is: ``cogging at the knee``."""
    title = title_in_words(effect)
    title = f"per-run {title}" if effect.each_run else title
    return f"{title} at {the(effect.joint)}" if effect.joint else title


def label_in_words(label: str, machine: Machine | None = None) -> str:
    """Return the wording of a cause, an unlisted law, or nothing.

    A machine's sliding joints have forces.
    """
    if label == NOTHING:
        return NOTHING
    return (
        law_in_words(label, machine) if label.startswith(LAW) else in_words(effect_labelled(label))
    )

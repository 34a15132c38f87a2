"""Write the evidence for a named cause, one sentence each."""

from pipelines.contracts.joints import the
from pipelines.diagnosis.diagnosis import Diagnosis
from pipelines.diagnosis.selection.answer import NamedCause, in_place
from pipelines.effects import Effect
from pipelines.wording.label import amount, effect_labelled, in_words, number

NEARLY_ALL = 0.9
"""Share of the systematic error below which the evidence says that a cause may be a look-alike."""


def cause_evidence(d: Diagnosis, named: NamedCause) -> list[str]:
    """Return the sentences for a named cause."""
    label = named.element.label
    effect, gained = d.effects[label], d.gains[label]
    machine, joint = d.baseline.machine, d.baseline.joints[gained.joint]
    # Causes overlap, so the gain is over the error that all other causes leave.
    before = d.without[label].errors.rms[gained.joint]
    others = " that the other causes leave" if len(d.named) > 1 else ""
    taken = number(machine, gained.value) if gained.value > 0.0 else "nothing"
    sentences = [
        f"it removes {taken} of {amount(machine, joint, before)} of {machine.joint(joint).effort} "
        f"error at {the(joint)}{others} on the validation runs"
    ]
    doubt = doubt_of_gain(d, label)
    if doubt:
        sentences.append(doubt[1])
    # A cause that was not tested for being a look-alike has no share, and no doubt of this kind.
    share = d.selected.removed.get(label, 1.0)
    if share < NEARLY_ALL:
        sentences.append(
            f"it removes {100.0 * share:.0f} % of the systematic error there, and a true cause"
            " removes nearly all; a part of its probability goes to an unlisted similar effect"
        )
    if effect.each_run:
        sentences.append(_differs(d, label, effect))
    assert d.selected.evidence is not None
    # Log likelihood from which auxiliary evidence is mentioned: odds of 20.
    mentioned_from = 3.0
    if d.selected.evidence.auxiliary.get(label, 0.0) > mentioned_from:
        sentences.append(effect.cuff_coherence)
    lines = len(named.element.lines)
    if lines:
        plural = "s stand" if lines > 1 else " stands"
        sentences.append(f"{lines} line{plural} out over the angle at the full sampling rate")
    rival = _next(d, named)
    if rival:
        sentences.append(rival)
    return [*sentences, f"it looks like {effect.looks_like}", f"to make sure: {effect.confirm}"]


def _differs(d: Diagnosis, label: str, effect: Effect) -> str:
    """List the values of a per-run cause."""
    (parameter,) = (p for p in effect.parameters if p.per_run)
    values = [f"{r['values'][parameter.name]:+.3g} in {r['file']}" for r in d.each_run[label]]
    return (
        f"each run has its own {parameter.name}, as of {effect.may_differ}: {', '.join(values)}"
        f" ({parameter.unit})"
    )


def doubt_of_gain(d: Diagnosis, label: str) -> tuple[str, str] | None:
    """Return in words that a gain may be chance, for the summary and alone; None if it is not."""
    gained = d.gains.get(label)
    if gained is None or gained.low > 0.0:
        return None
    if gained.high < 0.0:
        return (
            "which raises the error on the validation runs",
            "that is no gain: its 95 % interval lies below zero",
        )
    return "whose gain may be chance", "that gain may be chance: its 95 % interval includes zero"


def _next(d: Diagnosis, named: NamedCause) -> str | None:
    """Return in words how much less likely the next listed cause is in its place.

    The other named causes are kept.
    """
    assert d.selected.posterior is not None
    label, ties = named.element.label, dict(named.ties)
    own, rivals = in_place(d.selected.posterior, label, frozenset(d.causes) - {label})
    # Ties are no rivals: their probability counts for the cause.
    others = [(rival, p) for rival, p in rivals.items() if rival not in ties and p > 0.0]
    if not others:
        return None
    rival, p = others[0]
    odds = (own + sum(rivals[tied] for tied in ties)) / p
    # Odds above which no figure is given: no calibration supports one.
    certain = 1000.0
    times = (
        "no"
        if odds <= 1.0
        else f"{odds:.3g} times"
        if odds < certain
        else f"over {certain:g} times"
    )
    return (
        f"the next listed cause in its place, {in_words(effect_labelled(rival))}, is {times} less"
        " likely"
    )

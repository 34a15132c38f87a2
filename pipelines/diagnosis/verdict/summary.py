"""Write the summary: the verdict in one or two sentences, for the first look."""

from typing import Any

from pipelines.contracts.joints import the
from pipelines.contracts.verdict import Cause, Finding
from pipelines.diagnosis.criteria import CRITERIA
from pipelines.diagnosis.data_faults import Fault
from pipelines.diagnosis.diagnosis import Diagnosis
from pipelines.diagnosis.verdict.cause_evidence import NEARLY_ALL, doubt_of_gain
from pipelines.diagnosis.verdict.caveats import floor_that_hides
from pipelines.diagnosis.verdict.findings_in_words import findings
from pipelines.wording.label import amount, effect_of_cause, in_words, label_in_words
from pipelines.wording.law import UNLISTED


def summary(d: Diagnosis, causes: list[Cause], remainder: dict[str, Any] | None) -> str:
    """Return the verdict's first sentences."""
    if d.data.spoilt:
        return f"Acquisition, not physics: {_in_short(d.data.spoilt[0], d)}."
    text = finding_in_words(d, causes, remainder)
    text += _noise_without_periods(d)
    if d.data.left_out:
        text += f" Faults of acquisition were found as well: {_in_short(d.data.left_out[0], d)}."
    return text


def _noise_without_periods(d: Diagnosis) -> str:
    """Report noise that is estimated without differences of periods."""
    # Noise of the training runs weighs causes; that of the validation runs is the floor.
    weighed, floor = d.noise.from_periods, d.floor.from_periods
    # Where all runs were searched, some of them hold periods.
    if floor and (weighed or d.sought_on_all):
        return ""
    if floor:
        return (
            " No training run holds two usable periods, so the noise that weighs causes is"
            f" estimated from {_otherwise(d)}."
        )
    which = "validation run" if weighed else "run"
    why = f"No {which} holds two periods" if d.has_periods else "No recording names a period"
    return f" {why}, so the noise floor is estimated from {_otherwise(d)}."


def floor_from(d: Diagnosis) -> str:
    """Return the source of the noise floor in words."""
    return "periods" if d.floor.from_periods else _otherwise(d)


def _otherwise(d: Diagnosis) -> str:
    """Return the source of the noise without periods, in words."""
    if d.data.noisy_angles:
        return "the residual in the motion's own band"
    return "the band above the motion"


def _in_short(fault: Fault, d: Diagnosis) -> str:
    others = len(d.data.faults) - 1
    plural = "s" * (others > 1)
    more = f" (and {others} more fault{plural}, in data_faults of verdict.json)" if others else ""
    return f"{fault.file}, {fault.channel}: {fault.in_words}{more}"


def finding_in_words(d: Diagnosis, causes: list[Cause], remainder: dict[str, Any] | None) -> str:
    """Return the finding in words, without remarks on floor and faults."""
    described = f" {remainder['description']}" if remainder and remainder["description"] else ""
    if d.status == "nothing_missing":
        return f"{_nothing(d)}{described}"
    if d.status == "unknown_cause":
        return f"{_unlisted(d)} {_error_there(d)}{described}"
    return f"{_named(d, causes)}{described}"


def _worst_joint(d: Diagnosis) -> int:
    return int((d.before.errors.rms / d.floor_rms).argmax())


def _size(d: Diagnosis, place: int) -> str:
    """Return a joint's error, and its ratio to the noise floor, in words."""
    joint, error = d.baseline.joints[place], d.before.errors.rms[place]
    ratio = error / d.floor_rms[place]
    return f"{amount(d.baseline.machine, joint, error)}, {ratio:.2f} times the noise floor"


def _error_there(d: Diagnosis) -> str:
    """Return the error at the joint of the first finding, in words.

    Without a finding it is the joint whose error is largest compared with the noise.
    """
    of_finding = d.selected.findings[0].joint if d.selected.findings else None
    measured = of_finding in d.baseline.machine.measured_names
    place = d.baseline.joints.index(of_finding) if of_finding and measured else _worst_joint(d)
    joint = d.baseline.joints[place]
    effort = d.baseline.machine.joint(joint).effort
    return f"{the(joint).capitalize()}'s {effort} error is {_size(d, place)}."


def _nothing(d: Diagnosis) -> str:
    place = _worst_joint(d)
    joint = d.baseline.joints[place]
    effort = d.baseline.machine.joint(joint).effort
    text = (
        "Nothing is missing that these data could show (probability"
        f" {d.selected.answer.nothing:.2f}). Compared with the noise, the {effort} error is largest"
        f" at {the(joint)}: {_size(d, place)}"
    )
    hiding = floor_that_hides(d).get(joint)
    if hiding:
        text += f", but the floor itself is {hiding:.0%} of the {effort} and may hide effects"
    text = f"{text}.{_dropped(d) or _nearest(d)}"
    if d.is_mostly_unexplained:
        text += (
            " Most of that error is not noise, and neither a listed cause nor a smooth law"
            " explains it."
        )
    return text


def _nearest(d: Diagnosis) -> str:
    """Return in words the closest cause where nothing is likely to be missing."""
    weighed = d.selected.posterior
    label, p = next(iter(weighed.marginals.items()), ("", 0.0)) if weighed else ("", 0.0)
    if not _is_close(p):
        return ""
    words = label_in_words(label, d.baseline.machine)
    return f" {words[:1].upper()}{words[1:]} ({p:.2f}) comes closest."


def _is_close(probability: float) -> bool:
    """Return whether a cause is probable enough to be reported as the closest."""
    return probability >= 0.05


def _findings(d: Diagnosis) -> list[Finding]:
    return [Finding.model_validate(one) for one in findings(d)]


def _unlisted(d: Diagnosis) -> str:
    """Return in words, at the known depth, the missing effect that no listed cause explains."""
    results = _findings(d)
    if not results:
        return "Something is missing, and no listed cause is likely."
    first, *more = results
    also = "".join(f"; and {one.words} ({one.probability:.2f})" for one in more)
    which = (
        "that no listed cause explains"
        if d.selected.shows_unlisted
        else "and these data do not show which listed cause it is"
    )
    text = (
        f"Something is missing {which}: {first.words} (probability {first.probability:.2f}){also}."
    )
    laws = [law for law in first.laws if law.probability >= CRITERIA.named_from]
    # An unlisted effect that resembles a listed cause is described by that cause.
    if laws and laws[0].words != first.words and not laws[0].law.startswith(UNLISTED):
        text += f" Most likely it is {laws[0].words} ({laws[0].probability:.2f})."
    return f"{text}{_dropped(d) or _closest(d, first)}"


def _closest(d: Diagnosis, finding: Finding) -> str:
    """Return in words the closest listed cause, if any, and why it is not named."""
    closest = next((one for one in finding.causes if _is_close(one.probability)), None)
    if closest is None:
        return ""
    share = d.selected.removed.get(closest.label, 1.0)
    only = (
        f", but removes only {100.0 * share:.0f} % of the systematic error on the validation runs"
    )
    but = only if share < NEARLY_ALL else ""
    return f" Of the listed causes {closest.words} ({closest.probability:.2f}) comes closest{but}."


def _dropped(d: Diagnosis) -> str:
    """Return in words which causes the validation runs contradict, and how."""
    labels = sorted(d.selected.dropped)
    if not labels:
        return ""
    words = " and ".join(label_in_words(label, d.baseline.machine) for label in labels)
    plural = len(labels) > 1
    text = f" {words[:1].upper()}{words[1:]} would explain"
    if d.sought_on_all:
        they, lower, s = ("they", "lower", "") if plural else ("it", "lowers", "s")
        by_training = d.causes and not d.fitted_to_all
        how = "fitted to the training runs alone," if by_training else "in cross-validation"
        too_little = f"{they} {lower} the error on the validation runs too little, or raise{s} it"
        return f"{text} all runs together, but {how} {too_little}."
    return (
        f"{text} the training runs, but {'raise' if plural else 'raises'} the error on the"
        " validation runs."
    )


def _named(d: Diagnosis, causes: list[Cause]) -> str:
    """Return in words the named causes and their gain."""
    doubts = [doubt_of_gain(d, cause.label) for cause in causes]
    named = "; and ".join(
        _in_words(cause) + (f", {doubt[0]}" if doubt else "")
        for cause, doubt in zip(causes, doubts, strict=True)
    )
    before, after = d.before.errors.rms, d.after.errors.rms
    # The joint that gains most compared with its noise represents all.
    most = int(((before**2 - after**2) / d.floor_rms**2).argmax())
    joint, machine = d.baseline.joints[most], d.baseline.machine
    gain = (
        f"With {_they(causes)} {the(joint)}'s {machine.joint(joint).effort} error"
        f" {'falls' if after[most] < before[most] else 'rises'} from"
        f" {amount(machine, joint, before[most])}, {before[most] / d.floor_rms[most]:.2f} times the"
        f" noise floor, to {amount(machine, joint, after[most])}, {_remains(d, most)}."
    )
    rest = [one for one in _findings(d) if one.level != "cause"]
    also = "".join(f" Also missing: {one.words} ({one.probability:.2f})." for one in rest)
    return (
        f"Missing from the simulation: {named}."
        f" {gain}{_no_gain_at_its_own(d, causes)}{also}{_dropped(d)}"
    )


def _they(causes: list[Cause]) -> str:
    """Return the pronoun of the fitted causes; of tied causes the first is fitted."""
    if len(causes) > 1:
        return "them"
    return "the first of them" if causes[0].indistinguishable_from else "it"


def _no_gain_at_its_own(d: Diagnosis, causes: list[Cause]) -> str:
    """Report joints with a named cause whose error does not fall."""
    joints, after, before = d.baseline.joints, d.after.errors.rms, d.before.errors.rms
    with_one = {cause.joint for cause in causes} & set(d.baseline.machine.measured_names)
    none = [joint for j, joint in enumerate(joints) if joint in with_one and after[j] >= before[j]]
    return "".join(
        f" At {the(joint)}, where a cause is named, the error does not fall." for joint in none
    )


def _remains(d: Diagnosis, most: int) -> str:
    """Return in words the joint's distance from its floor, and other joints above theirs."""
    ratio = d.after.errors.rms / d.floor_rms
    # A joint may be above its floor and yet explained, if little of its error is left.
    above = d.left_over
    here = f"{'still ' if above[most] else ''}{ratio[most]:.2f} times the floor"
    others = [
        f"; {the(joint)}'s is then {amount(d.baseline.machine, joint, d.after.errors.rms[j])}, "
        f"{ratio[j]:.2f} times its floor"
        for j, joint in enumerate(d.baseline.joints)
        if above[j] and j != most
    ]
    return (here if ratio[most] > CRITERIA.at_floor else "which is noise") + "".join(others)


def _in_words(cause: Cause) -> str:
    """Return a cause, its ties, and their probability together, in words."""
    tied = [in_words(effect_of_cause(one)) for one in cause.with_ties]
    likely = f"{cause.probability:.2f}"
    if len(tied) == 1:
        return f"{tied[0]} (probability {likely})"
    # Largest number of tied causes in the summary; `indistinguishable_from` has all.
    mentioned = 3
    more = [f"{len(tied) - mentioned} more"] if len(tied) > mentioned else []
    *most, last = [*tied[:mentioned], *more]
    return f"{', '.join(most)} or {last}, which these data cannot separate (together {likely})"

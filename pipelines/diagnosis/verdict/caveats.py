"""Write the caveats: limits of the recordings at hand, whatever is missing."""

import numpy as np

from pipelines.contracts.joints import the
from pipelines.diagnosis.candidates.shape_refinement import reach
from pipelines.diagnosis.diagnosis import Diagnosis
from pipelines.diagnosis.fit.presliding_test import NEAR_S, BuildUp
from pipelines.effects import EFFECTS
from pipelines.estimation.angle_noise import CUTOFF_HZ, IN_WORDS
from pipelines.mechanics.geometry import Geometry
from pipelines.wording.label import amount, label_in_words


def caveats(d: Diagnosis) -> list[str]:
    """Return the caveats of the verdict, a sentence or two each."""
    noisy = (
        f"{IN_WORDS}. Fits would underestimate inertia, so only the band below {CUTOFF_HZ:g} Hz is "
        f"used: set filter.cutoff_hz = {CUTOFF_HZ:g} for the other stages, and check encoder "
        "counts and time stamps"
    )
    known = [
        f"{effect.label} is assumed present (`known`). Its size is fitted; its presence was not"
        " tested"
        for effect in d.baseline.known
    ]
    doubtful = [] if d.data.spoilt else [*_high_floor(d), *d.upside_down]
    unmeasured = d.baseline.machine.unmeasured_in_words
    return [
        *([unmeasured] if unmeasured else []),
        *known,
        *(f"{f.file}, {f.channel}: {f.in_words}" for f in d.data.doubts),
        *_at_ends(d),
        *_size_may_be_zero(d),
        *_default_length(d),
        *[noisy] * d.data.noisy_angles,
        *_unrealizable(d),
        *doubtful,
        *(_reversal(d, one) for one in d.reversals),
        *_by_all_runs(d),
        *_differs(d),
        *_one_run(d),
        *_one_kind(d),
    ]


def floor_that_hides(d: Diagnosis) -> dict[str, float]:
    """Return joints whose noise floor is high, with its share of their torque."""
    parts = zip(d.baseline.machine.joints, d.floor_rms, d.torque_rms, strict=True)
    # Without a sensor the torque is zero here.
    shares = {joint.name: float(f / t) for joint, f, t in parts if joint.has_sensor}
    # Share of a joint's torque above which a noise floor is doubtful: no sensor is as noisy, and
    # friction is seldom more.
    hiding = 0.2
    return {joint: share for joint, share in shares.items() if share > hiding}


def _high_floor(d: Diagnosis) -> list[str]:
    machine = d.baseline.machine
    measured = d.floor.from_periods
    known = "is" if measured else "is estimated as"
    record = "Check" if measured else "Repeat one motion and record its period, and check"
    return [
        f"the noise floor of {the(joint)} {known} {share:.0%} of its "
        f"{machine.joint(joint).effort}, more than any sensor's noise: it may hide missing "
        f"effects. {record} unit, sign and time stamps of that channel"
        for joint, share in floor_that_hides(d).items()
    ]


def _at_ends(d: Diagnosis) -> list[str]:
    """Report shapes of named causes that ended at the limit of their search.

    Their other values hold only with that shape.
    """
    return [
        f"the fit of {cause.label} ended at the limit of its search, {parameter.name} = {value:.3g}"
        f"{'' if parameter.unit == '1' else f' {parameter.unit}'}: "
        "its values hold only together, and its true form may be another"
        for cause in d.after.fit.causes
        for i, parameter in enumerate(cause.effect.shape)
        if cause.is_free(i) and i != cause.onset
        for value in {shape[i] for shape in cause.shapes}
        # At the end of its range a shape is the best that was tried, and no minimum.
        if any(np.isclose(value, end, rtol=1e-6) for end in reach(parameter))
    ]


def _size_may_be_zero(d: Diagnosis) -> list[str]:
    """Report named causes whose size the fitted runs do not separate from zero."""
    fitted = "all runs together" if d.fitted_to_all else "the training runs"
    return [
        f"{fitted} do not determine the size of"
        f" {label_in_words(cause.label, d.baseline.machine)}: its 95 % interval includes zero"
        for number, cause in enumerate(d.after.fit.causes)
        if not cause.effect.per_run
        and d.uncertainty.includes_zero(d.after.fit.values, d.after.fit.columns_of(number).slice)
    ]


def _unrealizable(d: Diagnosis) -> list[str]:
    # An inertia that is negative within its error is no evidence against the causes.
    if not d.causes or not d.lacks_mass:
        return []
    return [
        "the extended model's inertia is not physically realizable; treat the named causes with"
        f" caution: {reason}"
        for reason in d.unrealizable
    ]


def _default_length(d: Diagnosis) -> list[str]:
    """Report that the distance between two axes is an exoskeleton's default on another machine."""
    machine, length = d.baseline.machine, d.fitted_runs[0].motion.geometry.thigh_length_m
    # A map without this length leaves the default, so that an equal one counts as not given.
    default = length == Geometry().thigh_length_m
    if machine.is_exoskeleton or not machine.mechanism.has_length or not default:
        return []
    return [
        f"the distance between the axes of {machine.names[0]} and {machine.names[1]} is not given. "
        f"{length:g} m is assumed, an exoskeleton's: set geometry.thigh_length_m in the map, and "
        "import again"
    ]


def _reversal(d: Diagnosis, one: BuildUp) -> str:
    """Report the friction near a joint's reversals, which no fit uses."""
    machine = d.baseline.machine
    joint = machine.joint(one.joint)
    before, after = (amount(machine, one.joint, error) for error in (one.at_once, one.over_travel))
    # Two effects may have the same words.
    reasons = dict.fromkeys(effect.reversal_travel for effect in EFFECTS if effect.reversal_travel)
    return (
        f"near reversals {the(one.joint)}'s friction changes sign over about "
        f"{1e3 * one.travel:.1g} m{joint.unit('angle')} of travel: {', or '.join(reasons)}. "
        f"The model ignores it: the {joint.effort} error within "
        f"{NEAR_S:g} s of reversals is {before}, {after} with such a travel"
    )


def _by_all_runs(d: Diagnosis) -> list[str]:
    """Report that the validation runs helped to find the causes, and why."""
    alone = d.selected.training_alone
    if alone is None:
        return []
    named = " and ".join(label_in_words(label, d.baseline.machine) for label in alone)
    sentence = (
        f"causes were sought on all runs: the training runs alone name {named or 'no cause'}, and"
        " that leaves an error above the noise on the validation runs"
    )
    too_good = "the gain is a little too good: record"
    if d.fitted_to_all:
        sentence += (
            ". Fitted to these alone, the causes found do not predict the validation runs, so each"
            " half of these is predicted by a fit to all other data. The motion is the same, so"
            f" {too_good} training runs that show the causes"
        )
    elif d.causes:
        sentence += f". Therefore {too_good} another run to validate on"
    return [sentence]


def _differing(d: Diagnosis) -> dict[str, tuple[float, float]]:
    """Return joints whose validation error is larger, with it and with the training error."""
    # The fit has errors of the cuffs too, after those of the drives.
    errors = zip(d.after.errors.rms.tolist(), d.after.fit.rms.tolist(), strict=False)
    pairs = zip(d.baseline.joints, errors, strict=True)
    # Error of the validation runs over that of the training runs from which a caveat reports it.
    larger = 2.0
    return (
        {}
        if d.data.spoilt or d.fitted_to_all
        else {joint: both for joint, both in pairs if both[0] > larger * both[1]}
    )


def _differs(d: Diagnosis) -> list[str]:
    """Report joints whose validation runs have an error that no training run shows."""
    machine = d.baseline.machine
    return [
        f"{the(joint)}'s {machine.joint(joint).effort} error is {amount(machine, joint, validated)}"
        f" on the validation runs and {amount(machine, joint, trained)} on the training runs. They"
        " differ in something that no training run shows: train and validate on runs of both sorts"
        for joint, (validated, trained) in _differing(d).items()
    ]


def _one_run(d: Diagnosis) -> list[str]:
    """Report the limits of one training run, unless a cause is named."""
    if d.causes or d.data.spoilt or len(d.fitted_runs) > 1 or d.sought_on_all:
        return []
    if d.status == "nothing_missing" and not _differing(d):
        return []
    return [
        "there is one training run only: a zero that is set at each start looks like one for all "
        "runs. Record another training run after a new start"
    ]


def _one_kind(d: Diagnosis) -> list[str]:
    """Report the limits of runs of one kind."""
    kinds = {run.motion.run for run in d.fitted_runs}
    # Other machines have no wearer.
    if kinds == {"exo_alone"} and d.baseline.machine.is_exoskeleton:
        return [
            "every run is without a person: effects of a person do not show, and a shifted zero "
            "looks like a mass off the axis. Record with_human runs as well"
        ]
    if kinds == {"with_human"}:
        has_cuffs = any(run.motion.forces is not None for run in d.training_runs)
        apart = "are separated by the cuff forces alone" if has_cuffs else "cannot be separated"
        return [
            f"every run is with a person: causes in the machine and in the person {apart}, and the "
            "machine's friction alone is unknown. Record exo_alone runs as well"
        ]
    return []

"""Prepare a session: check eligibility, mark faults, downsample, split by purpose, observe."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pipelines.contracts.fault_kind import FaultKind
from pipelines.contracts.joints import the
from pipelines.diagnosis.data_faults import Fault, excluding, find_faults
from pipelines.diagnosis.evidence.baseline import Baseline, baseline_of, only_trained_outputs
from pipelines.diagnosis.evidence.downsampling import downsampled
from pipelines.diagnosis.evidence.eligibility import refuse_unfit
from pipelines.diagnosis.evidence.known_effects import known_effects
from pipelines.diagnosis.evidence.noise_floor import noise_floor
from pipelines.diagnosis.evidence.observed_run import Run, observe
from pipelines.effects.effect import Effect
from pipelines.errors import InputError
from pipelines.estimation.angle_noise import CUTOFF_HZ, is_loud
from pipelines.mechanics.even_grid import on_even_grid
from pipelines.mechanics.motion import Motion
from pipelines.mechanics.remedies import how_to_add
from pipelines.mechanics.scale import on_one_scale


@dataclass(frozen=True)
class TrainingData:
    """The prepared runs of one session."""

    train: tuple[Run, ...]
    validate: tuple[Run, ...]
    baseline: Baseline
    faults: tuple[Fault, ...]
    noisy_angles: bool
    """Whether only the band below 5 Hz is used, because the angles are noise above it."""

    @property
    def spoilt(self) -> list[Fault]:
        """Faults of acquisition that prevent any statement about physics."""
        return [fault for fault in self.faults if fault.spoils]

    @property
    def doubts(self) -> list[Fault]:
        """Faults that the diagnosis uses as recorded: they change little, or are accepted."""
        return [fault for fault in self.faults if fault.is_used and not fault.spoils]

    @property
    def left_out(self) -> list[Fault]:
        """Faults whose samples, or whose cuffs, are left out."""
        return [fault for fault in self.faults if not fault.is_used]


def training_data(
    motions: Sequence[Motion], known: Sequence[str] = (), accept: Sequence[FaultKind] = ()
) -> TrainingData:
    """Prepare a session's motions.

    Parameters
    ----------
    motions : sequence of Motion
        Runs of one machine, some to train and some to validate.
    known : sequence of str
        Labels of effects that the machine is known to have, without rigid body and friction.
    accept : sequence of FaultKind
        Kinds of faults of acquisition whose veto the user overrules.

    Returns
    -------
    TrainingData

    Raises
    ------
    InputError
        Where runs are missing or too short, or an effect in ``known`` cannot be part of the
        baseline.
    """
    motions = on_one_scale(motions)
    refuse_unfit(motions)
    effects = known_effects(known, motions[0].machine)
    faults = find_faults(motions, accept)
    try:
        return _prepared(motions, faults, effects)
    except InputError:
        # Too little remains without samples that the user accepts: they are used as recorded.
        accepted = [_accepted(fault, accept) for fault in faults]
        if accepted == faults:
            raise
        return _prepared(motions, accepted, effects)


def _accepted(fault: Fault, accept: Sequence[FaultKind]) -> Fault:
    """Return a fault whose samples are used as recorded, if the user accepts its kind."""
    if fault.samples is None or fault.kind not in accept:
        return fault
    # A run that is left out whole has others in its place.
    is_part = fault.samples.any() and not fault.samples.all()
    return fault.used_as_recorded() if is_part else fault


def _prepared(
    motions: Sequence[Motion], faults: Sequence[Fault], effects: Sequence[Effect]
) -> TrainingData:
    """Return the runs without the samples that faults leave out, and the baseline.

    Raises
    ------
    InputError
        Too little remains to train, to validate or to estimate the noise.
    """
    valid = [
        downsampled(on_even_grid(motion))
        for motion in excluding(motions, faults)
        if motion.valid.any()
    ]
    _refuse_missing_purpose(valid, faults)
    # Training runs alone decide, as no fit may depend on validation runs.
    noisy = is_loud([motion for motion in valid if motion.purpose == "train"])
    runs = [observe(motion, CUTOFF_HZ if noisy else None) for motion in valid]
    train, validate = (
        tuple(run for run in runs if run.motion.purpose == purpose)
        for purpose in ("train", "validate")
    )
    # A spoilt session gets a verdict on its faults instead of an error about its noise.
    if not any(fault.spoils for fault in faults):
        _refuse_unknown_noise(validate, faults)
    baseline = baseline_of(train, effects)
    return TrainingData(
        train,
        tuple(only_trained_outputs(run, baseline) for run in validate),
        baseline,
        tuple(faults),
        noisy,
    )


def _refuse_missing_purpose(motions: Sequence[Motion], faults: Sequence[Fault]) -> None:
    """Raise InputError without a training or a validation run, or with a kind to validate only."""
    listed = ", ".join(f"{m.file} ({m.run}, {m.purpose})" for m in motions) or "none"
    reasons = {"train": "the model is fitted there", "validate": "the gain is measured there"}
    for purpose, why in reasons.items():
        if not any(m.purpose == purpose for m in motions):
            wrong = "".join(f"; {f.file}: {f.in_words}" for f in faults if f.samples is not None)
            raise InputError(
                f"found no run to {purpose} on among: {listed}; {why}:"
                f" {how_to_add(purpose, motions)}{wrong}"
            )
    trained = {m.run for m in motions if m.purpose == "train"}
    strangers = [m.file for m in motions if m.purpose == "validate" and m.run not in trained]
    if strangers:
        kind = next(m.run for m in motions if m.file == strangers[0])
        raise InputError(
            f"{strangers[0]}: found a {kind} run to validate on and none to train on, among:"
            f" {listed}; record a training run of that kind, or leave this one out"
        )


def _refuse_unknown_noise(validate: Sequence[Run], faults: Sequence[Fault]) -> None:
    """Raise InputError where too little of the validation runs is usable to estimate the noise."""
    joints = validate[0].motion.joints
    # The torque stands for the residual here: only whether blocks suffice matters.
    floor = noise_floor(validate, [run.measured for run in validate]).rms[: len(joints)]
    for j, joint in enumerate(joints):
        if validate[0].motion.machine.measured[j] and not np.isfinite(floor[j]):
            usable = sum(int(run.usable[:, j].sum()) for run in validate)
            files = [run.motion.file for run in validate]
            # The fault that leaves most samples out comes first.
            wrong = sorted((f for f in faults if f.file in files), key=_left_out, reverse=True)
            remedy = "validate on longer runs"
            if wrong:
                more = f" (and {len(wrong) - 1} more)" if len(wrong) > 1 else ""
                remedy = f"correct first {wrong[0].file}: {wrong[0].in_words}{more}"
            raise InputError(
                f"{', '.join(files)}: {usable} blocks away from {the(joint)}'s reversals, too few"
                f" in a row to separate noise from error; {remedy}"
            )


def _left_out(fault: Fault) -> int:
    """Return the number of samples that a fault leaves out."""
    return 0 if fault.samples is None else int(fault.samples.sum())

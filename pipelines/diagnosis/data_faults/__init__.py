"""Data faults: errors between the leg and its file, found before physics is blamed.

Time is checked first, then single channels, then the wiring of channels, then their units. Each
check uses only the samples that those before it left valid. Slow or small changes that physics can
make (a drift, a gain of a few tens of percent, an offset) are no faults. A fault stops the
diagnosis only where its proof shows that mending it would change the answer (``proof.py``).
"""

from collections.abc import Container, Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pipelines.contracts.fault_kind import FaultKind
from pipelines.diagnosis.data_faults.channels import channel_faults
from pipelines.diagnosis.data_faults.fault import Fault
from pipelines.diagnosis.data_faults.proof import Ruling, by_good_samples
from pipelines.diagnosis.data_faults.rigid_fit import Averages, averages
from pipelines.diagnosis.data_faults.sampling_instants import sampling_faults
from pipelines.diagnosis.data_faults.sign import sign_faults
from pipelines.diagnosis.data_faults.sign_bit import sign_bit_faults
from pipelines.diagnosis.data_faults.timing import timing_faults
from pipelines.diagnosis.data_faults.units import angle_unit_faults, torque_unit_faults
from pipelines.diagnosis.data_faults.wiring import angle_faults, cuff_faults, wiring_faults
from pipelines.mechanics.motion import Motion

LEAST_S, LEAST_SHARE = 5.0, 0.5
"""Motion that must remain of an exoskeleton's run without its faulty samples, s; of a short run,
this share."""

__all__ = ["Fault", "excluding", "find_faults"]


def find_faults(motions: Sequence[Motion], accept: Sequence[FaultKind] = ()) -> list[Fault]:
    """Return the faults of acquisition in a session's runs, in the order of the runs.

    Parameters
    ----------
    motions : sequence of Motion
        All runs of one leg, made from recordings, so that they have the measured angles.
    accept : sequence of FaultKind
        Kinds of faults whose veto the user overrules.

    Returns
    -------
    list of Fault
    """
    faults = [
        fault for motion in motions for fault in (*timing_faults(motion), *channel_faults(motion))
    ]
    faults = _with_short_runs_left_out(motions, faults, accept)
    # A torque that is a copy has no scale, and no wiring, of its own.
    copied = {fault.file for fault in faults if fault.kind is FaultKind.COPY}
    legs: list[Averages] = []
    for motion in excluding(motions, faults):
        # A run that is left out whole has nothing to compare.
        if not motion.valid.any():
            continue
        faults += sampling_faults(motion)
        wrong = [*angle_faults(motion), *angle_unit_faults(motion), *sign_bit_faults(motion)]
        # One wrong channel makes later checks fail as well, so only the first kind is reported.
        wrong = wrong or [*sign_faults(motion)]
        faults += wrong
        compares = _has_two_torques(motion) and not wrong and motion.file not in copied
        run = averages(motion) if compares else None
        legs += [] if run is None else [run]
    faults += _of_legs(legs)
    files = [motion.file for motion in motions]
    judged = [fault.judged(tuple(accept)) for fault in faults]
    return sorted(judged, key=lambda fault: files.index(fault.file))


def _has_two_torques(motion: Motion) -> bool:
    """Return whether a motion is of a leg whose torques are both readings."""
    machine = motion.machine
    return machine.is_leg and all(joint.has_sensor for joint in machine.joints)


def _of_legs(runs: Sequence[Averages]) -> list[Fault]:
    """Return wrong wiring, and the wrong units of runs that are wired as they should be."""
    kinds = dict.fromkeys(run.motion.run for run in runs)
    faults = [
        fault
        for kind in kinds
        for fault in wiring_faults([run for run in runs if run.motion.run == kind])
    ]
    # Exchanged channels look like wrong units, so only correctly wired runs are compared in scale.
    wrong = {fault.file for fault in faults}
    faults += [f for run in runs if run.motion.file not in wrong for f in cuff_faults(run)]
    wrong = {fault.file for fault in faults}
    return [*faults, *torque_unit_faults([r for r in runs if r.motion.file not in wrong])]


def _with_short_runs_left_out(
    motions: Sequence[Motion], faults: Sequence[Fault], accept: Sequence[FaultKind]
) -> list[Fault]:
    """Return the faults; those of runs with too few good samples mask or veto the whole run.

    Where other runs of its kind suffice, such a run is masked as a whole. Otherwise its faults are
    judged by what the good samples of all runs predict.
    """
    sound = excluding(motions, faults)
    hopeless = {m.file: m for whole, m in zip(motions, sound, strict=True) if _too_little(whole, m)}
    whole_runs = {motion.file: motion for motion in motions}
    reported: list[Fault] = []
    for fault in faults:
        run = hopeless.get(fault.file)
        if run is None or fault.samples is None or not fault.samples.any():
            reported.append(fault)
        elif _others_suffice(run, motions, hopeless):
            what, samples = f"{fault.what}; this run is left out", np.ones(len(run), bool)
            reported.append(replace(fault, what=what, samples=samples))
        else:
            proof = by_good_samples(whole_runs[fault.file], sound)
            needed = proof is None or (proof.ruling is Ruling.VETO and fault.kind not in accept)
            # Samples that do no harm, or that the user accepts, are used as recorded.
            left_out = fault.samples if needed else None
            reported.append(replace(fault, samples=left_out, proof=proof))
    return reported


def _too_little(whole: Motion, sound: Motion) -> bool:
    least = min(
        sound.machine.lasting(LEAST_S) * sound.sample_rate_hz, LEAST_SHARE * whole.valid.sum()
    )
    return bool(sound.valid.sum() < least)


def _others_suffice(run: Motion, motions: Sequence[Motion], hopeless: Container[str]) -> bool:
    """Return whether half of the samples of a run's kind and purpose are in usable runs."""
    alike = [m for m in motions if (m.run, m.purpose) == (run.run, run.purpose)]
    usable = sum(len(m) for m in alike if m.file not in hopeless)
    return usable >= LEAST_SHARE * sum(map(len, alike))


def excluding(motions: Sequence[Motion], faults: Iterable[Fault]) -> list[Motion]:
    """Return the motions with the faults' samples invalid, and without cuffs that are left out."""
    faults = list(faults)
    bad: dict[str, NDArray] = {}
    for fault in faults:
        if fault.samples is not None:
            before = bad.get(fault.file)
            bad[fault.file] = fault.samples if before is None else before | fault.samples
    valid = [replace(m, valid=m.valid & ~bad[m.file]) if m.file in bad else m for m in motions]
    # A cuff that is silent would testify that the wearer weighs nothing.
    silent = {fault.file for fault in faults if fault.without_cuffs}
    return [replace(m, forces=None) if m.file in silent else m for m in valid]

"""Data faults: errors between the leg and its file, found before physics is blamed.

Time is checked first, then single channels, then the wiring of channels, then their units. Each
check uses only the samples that those before it left valid. Slow or small changes that physics can
make (a drift, a gain of a few tens of percent, an offset) are no faults.
"""

from collections.abc import Container, Iterable, Sequence
from dataclasses import replace

import numpy as np

from pipelines.diagnosis.data_faults.channels import channel_faults, has_silent_cuffs
from pipelines.diagnosis.data_faults.fault import Fault
from pipelines.diagnosis.data_faults.nonnegative_leg import averages
from pipelines.diagnosis.data_faults.sampling_instants import sampling_faults
from pipelines.diagnosis.data_faults.sign import sign_faults
from pipelines.diagnosis.data_faults.timing import timing_faults
from pipelines.diagnosis.data_faults.units import angle_unit_faults, torque_unit_faults
from pipelines.diagnosis.data_faults.wiring import angle_faults, cuff_faults, wiring_faults
from pipelines.mechanics.motion import Motion

LEAST_S, LEAST_SHARE = 5.0, 0.5
"""Motion that must remain of an exoskeleton's run without its faulty samples, s; of a short run,
this share."""

__all__ = ["Fault", "excluding", "find_faults"]


def find_faults(motions: Sequence[Motion]) -> list[Fault]:
    """Return the faults of acquisition in a session's runs, in the order of the runs.

    Parameters
    ----------
    motions : sequence of Motion
        All runs of one leg, made from recordings, so that they have the measured angles.

    Returns
    -------
    list of Fault
    """
    faults = [
        fault for motion in motions for fault in (*timing_faults(motion), *channel_faults(motion))
    ]
    faults = _with_short_runs_left_out(motions, faults)
    rightly_wired = []
    for motion in excluding(motions, faults):
        # A run that is left out whole has nothing to compare.
        if not motion.valid.any():
            continue
        faults += sampling_faults(motion)
        wrong = [*angle_faults(motion), *angle_unit_faults(motion)]
        # One wrong channel makes later checks fail as well, so only the first kind is reported.
        wrong = wrong or [*sign_faults(motion)]
        run = averages(motion)
        if run is not None and not wrong:
            wrong = [*wiring_faults(run), *cuff_faults(run)]
            # Exchanged channels look like wrong units, so
            # only correctly wired runs are compared in scale.
            rightly_wired += [] if wrong else [run]
        faults += wrong
    faults += torque_unit_faults(rightly_wired)
    files = [motion.file for motion in motions]
    return sorted(faults, key=lambda fault: files.index(fault.file))


def _with_short_runs_left_out(motions: Sequence[Motion], faults: Sequence[Fault]) -> list[Fault]:
    """Return the faults; those of runs with too few good samples mask or spoil the whole run.

    Where other runs of its kind suffice, such a run is masked as a whole. Otherwise its faults
    have no mask.
    """
    sound = excluding(motions, faults)
    hopeless = {m.file: m for whole, m in zip(motions, sound, strict=True) if _too_little(whole, m)}
    reported: list[Fault] = []
    # A fault without samples spoils the session; a run that others replace is masked as a whole.
    for fault in faults:
        run = hopeless.get(fault.file)
        if run is not None:
            if fault.samples is None or not _others_suffice(run, motions, hopeless):
                fault = replace(fault, samples=None)
            else:
                what, whole = f"{fault.what}; this run is left out", np.ones(len(run), bool)
                fault = replace(fault, what=what, samples=whole)
        reported.append(fault)
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
    """Return the motions with the faults' samples invalid, and without cuffs that never change."""
    bad: dict[str, np.ndarray] = {}
    for fault in faults:
        if fault.samples is not None:
            bad[fault.file] = bad.get(fault.file, False) | fault.samples
    valid = [replace(m, valid=m.valid & ~bad[m.file]) if m.file in bad else m for m in motions]
    # A cuff that is silent would testify that the wearer weighs nothing.
    return [replace(m, forces=None) if has_silent_cuffs(m) else m for m in valid]

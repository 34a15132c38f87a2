"""The true noise floor: what is left when everything hidden is known, after the regression
filter."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, filtfilt

from tests.campaigns.blind.body import Body
from tests.campaigns.blind.excitation import baseline_columns
from tests.campaigns.blind.recorded import Recorded, Rig

PADDING_S = 1.0
CUTOFFS_HZ = (3.0, 5.0, 8.0, 12.0, 18.0)


def noise_floor(rig: Rig, runs: Sequence[Recorded]) -> NDArray:
    """RMS (2,) N·m of measured torque less the truth's, along the measured motion, pooled over
    runs.

    The truth along a motion that was measured with coarse encoders and filtered is itself noisy; of
    some cut-offs the best counts, as the most that any method could reach.
    """
    squares = np.min([_squares(rig, runs, hz) for hz in CUTOFFS_HZ], axis=0)
    return np.sqrt(squares)


def ripple_floor(runs: Sequence[Recorded]) -> NDArray:
    """The same with the motion known exactly: the error of the measured torque alone, (2,) N·m."""
    errors = [r.blocks(r.torque - r.clean_torque)[_scored(r)] for r in runs]
    return np.sqrt(np.mean(np.concatenate(errors) ** 2, axis=0))


def left_by_the_baseline(rig: Rig, runs: Sequence[Recorded]) -> NDArray:
    """RMS (2,) N·m of the hidden effects that rigid body and friction cannot imitate, over these
    runs."""
    kinds = sorted({r.run.kind for r in runs})
    rows, effects = [], []
    for r in runs:
        # Along the true links: near enough to the reported motion to span what the baseline can
        # absorb.
        q, dq, ddq = (r.link[:, 2 * i : 2 * i + 2] for i in range(3))
        Y = baseline_columns(q, dq, ddq, rig.machine.leg.length, rig.machine.leg.gravity)
        wide = np.zeros((*Y.shape[:2], 4 * len(kinds) + 4))
        k = kinds.index(r.run.kind)
        wide[:, :, 4 * k : 4 * k + 4], wide[:, :, -4:] = Y[:, :, :4], Y[:, :, 4:]
        scored = _scored(r)
        wide = np.append(wide, np.full((*wide.shape[:2], 1), rig.weight) * [[1.0], [0.0]], axis=2)
        rows.append(r.blocks(wide)[scored])
        effects.append(r.blocks(r.effect)[scored])
    A, b = np.concatenate(rows), np.concatenate(effects)
    fit = np.linalg.lstsq(A.reshape(-1, A.shape[2]), b.ravel(), rcond=None)[0]
    return np.sqrt(np.mean((b - A @ fit) ** 2, axis=0))


def _squares(rig: Rig, runs: Sequence[Recorded], cutoff_hz: float) -> NDArray:
    errors = []
    for r in runs:
        b, a = butter(4, cutoff_hz, fs=1.0 / r.sample_s)
        q = filtfilt(b, a, r.angle, axis=0, padlen=round(PADDING_S / r.sample_s))
        dq = np.gradient(q, r.sample_s, axis=0)
        ddq = np.gradient(dq, r.sample_s, axis=0)
        needed = Body(rig.leg(r.run)).inverse(q, dq, ddq)
        needed[:, 0] += rig.machine.hip_rotor * ddq[:, 0] + rig.weight
        needed += rig.machine.coulomb * np.sign(r.true_speed) + rig.machine.viscous * dq
        errors.append(r.blocks(r.torque - r.effect - needed)[_scored(r)])
    return np.mean(np.concatenate(errors) ** 2, axis=0)


def _scored(r: Recorded) -> NDArray:
    """Return the blocks in which every joint moves that ever does, (m,) bool."""
    moving = r.moving()
    return moving[:, moving.any(axis=0)].all(axis=1)

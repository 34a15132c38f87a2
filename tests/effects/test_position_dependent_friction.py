"""Friction by position: any smooth level within the fitted positions, none made up beyond them."""

import numpy as np
import pytest

from pipelines.diagnosis.candidates.shape_grid import values_in
from pipelines.diagnosis.evidence.observed_run import observe
from pipelines.effects.position_dependent_friction import PositionDependentFriction

KNEE = 1
EFFECT = PositionDependentFriction("knee")


def _fit(motion, rows, torque):
    """Return columns with a constant level, and the least-squares values from some rows."""
    q = motion.q[:, KNEE]
    ends = float(q[rows].min()), float(q[rows].max())
    columns = EFFECT.columns(motion, ends)[:, KNEE]
    # The baseline has a constant level already.
    columns = np.column_stack([columns, np.sign(motion.dq[:, KNEE])])
    return columns, np.linalg.lstsq(columns[rows], torque[rows], rcond=None)[0]


@pytest.mark.parametrize("waves", [0.6, 1.0, 1.6])
@pytest.mark.parametrize("phase", [0.0, 1.0, 2.0])
def test_a_level_that_waves_is_followed_and_stays_within_reason_beyond(with_human, waves, phase):
    q, way = with_human.q[:, KNEE], np.sign(with_human.dq[:, KNEE])
    x = (q - q.min()) / np.ptp(q)
    torque = np.sin(2.0 * np.pi * waves * x + phase) * way
    inside = (x > 0.1) & (x < 0.9)
    columns, values = _fit(with_human, inside, torque)
    rest = torque - columns @ values
    assert np.std(rest[inside]) < 0.25 * np.std(torque[inside])
    # Continued by the polynomial, it would be wrong by several times the whole level.
    assert np.abs(rest[~inside]).max() < 1.5


def test_beyond_its_ends_the_level_stays_the_same(with_human):
    q, way = with_human.q[:, KNEE], np.sign(with_human.dq[:, KNEE])
    low, high = np.quantile(q, [0.2, 0.8])
    columns = EFFECT.columns(with_human, (low, high))[:, KNEE] * way[:, np.newaxis]
    for beyond in (q <= low, q >= high):
        moving = beyond & (way != 0.0)
        assert np.ptp(columns[moving], axis=0) == pytest.approx(0.0, abs=1e-9)
        assert np.abs(columns[moving]).max() > 0.1


def test_a_search_takes_the_ends_from_the_motion(with_human):
    runs = [observe(with_human)]
    ends = [values_in(EFFECT, parameter, 8, runs) for parameter in EFFECT.shape]
    q = runs[0].state[0][:, KNEE]
    assert np.concatenate(ends) == pytest.approx([q.min(), q.max()])


def test_without_ends_it_is_the_plain_polynomial(with_human):
    q, way = with_human.q[:, KNEE], np.sign(with_human.dq[:, KNEE])
    columns = EFFECT.columns(with_human)[:, KNEE]
    assert columns[:, 0] == pytest.approx(q * way)
    assert columns[:, 1] == pytest.approx(q**2 * way)

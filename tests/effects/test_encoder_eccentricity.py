"""An encoder off its axis: seen through, recovered, and in proportion to its columns."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import least_squares

from pipelines.contracts import Joint
from pipelines.effects.baseline import Friction, RigidBody
from pipelines.effects.encoder_eccentricity import EncoderEccentricity
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.machine import machine_of
from pipelines.model import Model, Term
from tests.diagnosis.screening import Screening
from tests.diagnosis.sessions import session

BODY = Term(RigidBody(), np.array([2.6, 0.63, 1.78, 5.7]))
FRICTION = tuple(Term(Friction(joint), np.array([2.0, 3.0])) for joint in ("hip", "knee"))
HIDDEN = EncoderEccentricity("knee").values_from(np.array([0.04, 0.6, 0.01, -1.2]))


def read_by(encoder, values, motion):
    """Return the motion as an encoder tells it, speeds and accelerations by the chain rule."""
    q, dq, ddq = motion.q.copy(), motion.dq.copy(), motion.ddq.copy()
    j = encoder.column(motion)
    angle, step = motion.q[:, j], 1e-4

    def told(x):
        read = np.zeros((len(x), 2))
        read[:, j] = x
        for row in read:
            encoder.reading(row, values, j)
        return read[:, j]

    ahead, here, behind = told(angle + step), told(angle), told(angle - step)
    slope, curvature = (ahead - behind) / (2 * step), (ahead - 2 * here + behind) / step**2
    q[:, j] = here
    dq[:, j] = slope * motion.dq[:, j]
    ddq[:, j] = slope * motion.ddq[:, j] + curvature * motion.dq[:, j] ** 2
    return replace(motion, q=q, dq=dq, ddq=ddq)


def test_speed_and_acceleration_behind_the_encoder_are_the_true_ones(with_human):
    encoder = EncoderEccentricity("knee")
    told = read_by(encoder, HIDDEN, with_human)
    assert np.abs(told.ddq - with_human.ddq).max() > 0.02
    true = encoder.corrected(told, HIDDEN)
    assert_allclose(true.q, with_human.q, atol=1e-12)
    assert_allclose(true.dq, with_human.dq, atol=1e-6)
    assert_allclose(true.ddq, with_human.ddq, atol=1e-5)


def test_an_eccentricity_is_recovered_from_a_simulated_motion(with_human):
    """Body, friction and the encoder's four numbers from one noisy period of one load."""
    rng = np.random.default_rng(11)
    torque = Model((BODY, *FRICTION)).torque(with_human)
    noise = rng.normal(0.0, 0.05, torque.shape)
    told = read_by(EncoderEccentricity("knee"), HIDDEN, with_human)
    motion = replace(told, torque=torque + noise)

    def left(values):
        term = Term(EncoderEccentricity("knee"), values)
        A = Model((BODY, *FRICTION, term)).regressor(motion).reshape(-1, 8)
        y = motion.torque.ravel()
        return y - A @ np.linalg.lstsq(A, y, rcond=None)[0]

    found = least_squares(left, np.zeros(4), x_scale=0.01)
    covariance = np.linalg.inv(found.jac.T @ found.jac) * 0.05**2
    wrong = np.abs(found.x - HIDDEN) / np.sqrt(np.diag(covariance))
    assert wrong.max() < 4.0
    assert np.sqrt(np.mean(left(found.x) ** 2)) < 0.0505
    assert np.sqrt(np.mean(left(np.zeros(4)) ** 2)) > 0.08


def test_its_candidates_have_a_column_for_each_sine_and_cosine_which_add_up_to_it():
    """Each column's amplitude times the error that the column was made with is the hidden error's
    part."""
    hidden = {"amplitude": 0.05, "phase": 0.4}
    look = Screening.of(session("encoder_eccentricity", "hip", seconds=20.0, **hidden))
    fits = look.fits(EncoderEccentricity("hip"))
    assert sorted(fitted.columns.shape[1] for fitted in fits) == [2, 4]
    once = next(fitted for fitted in fits if fitted.columns.shape[1] == 2)
    assert_allclose(
        look.refined(once), [0.05 * np.cos(0.4), 0.05 * np.sin(0.4), 0.0, 0.0], atol=0.01
    )


@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
def test_only_what_turns_has_an_eccentric_encoder(kind):
    machine = machine_of([Joint("axis", kind)], Geometry(gravity_m_s2=0.0))
    assert EncoderEccentricity.possible(machine) == (["axis"] if kind == "revolute" else [])


def test_an_error_of_zero_has_an_amplitude_and_no_interval_of_its_phase():
    values = np.array([0.03, 0.02, 0.0, 0.0])
    jacobian = EncoderEccentricity("hip").jacobian(values)
    assert not jacobian[2:].any()
    assert_allclose(jacobian[0, :2], values[:2] / np.hypot(0.03, 0.02))

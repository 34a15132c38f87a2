"""A torque channel that reads the other joint's torque too."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import minimize_scalar

from pipelines.contracts import Joint
from pipelines.effects.baseline import Friction, RigidBody
from pipelines.effects.torque_cross_talk import TorqueCrossTalk
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.machine import machine_of
from pipelines.model import Model, Term
from tests.diagnosis.screening import Screening
from tests.diagnosis.sessions import session

BODY = Term(RigidBody(), np.array([2.6, 0.63, 1.78, 5.7]))
FRICTION = tuple(Term(Friction(joint), np.array([2.0, 3.0])) for joint in ("hip", "knee"))


def test_a_machine_of_one_joint_has_no_cross_talk():
    pendulum = machine_of([Joint("arm")], Geometry())
    assert TorqueCrossTalk.possible(pendulum) == []


@pytest.mark.parametrize("joint", ["hip", "knee"])
def test_a_coupling_is_recovered_from_the_measured_torques(with_human, joint):
    hidden = Term(TorqueCrossTalk(joint), np.array([0.12]))
    rng = np.random.default_rng(3)
    torque = Model((BODY, *FRICTION, hidden)).torque(with_human)
    motion = replace(with_human, torque=torque + rng.normal(0.0, 0.3, torque.shape))

    def left(coupling):
        terms = (BODY, *FRICTION, Term(TorqueCrossTalk(joint), np.array([coupling])))
        regressor = Model(terms).regressor(motion).reshape(-1, 8)
        return np.linalg.lstsq(regressor, motion.torque.ravel(), rcond=None)[1][0]

    found = minimize_scalar(left, bounds=(-0.3, 0.3), method="bounded").x
    assert_allclose(found, 0.12, atol=0.005)


def test_one_column_of_a_small_coupling_stands_for_every_coupling():
    """What the column's amplitude is, times the coupling that the column was made with."""
    look = Screening.of(session("torque_cross_talk", "hip", coupling=0.15, seconds=20.0))
    (fitted,) = look.fits(TorqueCrossTalk("hip"))
    assert_allclose(look.refined(fitted), [0.15], atol=0.03)

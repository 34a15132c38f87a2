"""One regressor for the torque of the drives and for what the cuffs measure."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from pipelines.effects import CoulombAsymmetry, CuffCompliance, PassiveJointTorque, TorqueGain
from pipelines.effects.baseline import RigidBody
from pipelines.mechanics.machine import THE_LEG
from pipelines.model import Model, Term, baseline
from tests.diagnosis.sessions import session

KINDS = ("exo_alone", "with_human")


@pytest.fixture(scope="module")
def motions():
    """A run without the wearer and one with."""
    return session()[::2]


def model(*terms):
    """The baseline with cuffs, and more terms."""
    return Model((*Model.of(baseline(THE_LEG, KINDS, cuffs=True)), *terms))


def test_the_drives_rows_are_the_same_with_and_without_those_of_the_cuffs(motions):
    one = model(Term(TorqueGain("hip"), np.array([1.2])), Term.of(CoulombAsymmetry("knee")))
    for motion in motions:
        both = one.regressor(motion, cuffs=True)
        assert both.shape == (len(motion), 4, 16)
        assert_array_equal(both[:, :2], one.regressor(motion))


def test_cuffs_measure_what_the_wearer_exerts_and_no_torque_sensor_changes_it(motions):
    terms = (
        Term(TorqueGain("hip"), np.array([1.2])),
        Term.of(PassiveJointTorque("knee"), (0.2, 0.1)),
    )
    alone, worn = (model(*terms).regressor(motion, cuffs=True) for motion in motions)
    assert not alone[:, 2:].any()
    wearer = [4, 5, 6, 7]
    assert not worn[:, 2:, :4].any()
    assert_allclose(worn[:, 0, wearer], 1.2 * worn[:, 2, wearer])
    assert_array_equal(worn[:, 1, wearer], worn[:, 3, wearer])
    assert_array_equal(worn[:, 1, -1], worn[:, 3, -1])


def test_zeros_of_force_sensors_make_the_torque_of_such_forces(motions):
    worn = motions[1]
    zeros = np.array([1.5, -2.0, 3.0])
    columns = model().regressor(worn, cuffs=True)
    assert not columns[:, :2, -3:].any()
    forces = np.zeros_like(worn.forces)
    forces[:, 2, 0], forces[:, 2, 1], forces[:, 0, 1] = zeros
    expected = replace(worn, forces=forces).cuff_torque(worn.q)
    assert_allclose(columns[:, 2:, -3:] @ zeros, expected, atol=1e-12)
    assert not model().regressor(motions[0], cuffs=True)[:, :, -3:].any()


def test_a_limb_that_moves_in_its_cuff_has_its_own_motion_and_the_machine_the_links(motions):
    worn = motions[1]
    soft = model(Term(CuffCompliance("hip"), np.array([200.0])))
    rigid, moved = (one.regressor(worn, cuffs=True) for one in (model(), soft))
    limb = soft.motions(worn).limb
    assert_array_equal(moved[:, :, :4], rigid[:, :, :4])
    assert_array_equal(moved[:, 2:, 4:8], RigidBody().columns(limb))
    assert np.abs(limb.q - worn.q).max() > 1e-3


def test_a_rigid_bodys_columns_are_what_its_kernel_makes_of_unit_values(motions):
    for motion in motions:
        of_kernel = np.zeros((*motion.q.shape, 4))
        RigidBody()._react(motion, np.zeros(4), of_kernel)
        assert_array_equal(RigidBody().columns(motion), of_kernel)

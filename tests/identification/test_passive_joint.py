"""A joint without a drive: its torque is zero, and its equation informs the whole body."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pipelines.errors import InputError
from pipelines.identification import identify
from tests.diagnosis.free_elbow import TRUTH, free_elbow, motion_of


def runs(driven=0, **log):
    return [
        motion_of(free_elbow(seed, driven=driven, **log), purpose, driven)
        for seed, purpose in ((1, "train"), (2, "validate"))
    ]


@pytest.mark.parametrize("driven", [0, 1], ids=["free elbow", "free shoulder"])
def test_bodies_and_friction_of_both_joints_follow_from_one_drive(driven):
    table = identify(runs(driven)).parameters
    assert_allclose(table["value"][:4], TRUTH[:4], rtol=0.01)
    assert_allclose(table["value"][4:], TRUTH[4:], rtol=0.1, atol=0.002)


def test_noise_does_not_make_all_parameters_too_small():
    """With an equation of zero torque, plain least squares is fitted best by a weightless arm."""
    table = identify(runs(noise=0.4)).parameters
    errors = table["value"][:4] - TRUTH[:4]
    assert np.all(np.abs(errors) < 3.0 * table["std_error"][:4])
    assert_allclose(table["value"][:4], TRUTH[:4], rtol=0.03)


def test_without_any_drive_the_scale_of_the_parameters_is_unknown():
    run, other = runs()
    joints = [entry | {"drive": "none"} for entry in run.metadata["joints"]]
    passive = [replace(m, metadata=m.metadata | {"joints": joints}) for m in (run, other)]
    with pytest.raises(InputError, match=r"no joint of .* has a measured torque"):
        identify(passive)


def test_the_torque_of_a_driven_joint_that_is_zero_is_still_refused():
    run, other = runs()
    joints = [{"name": entry["name"]} for entry in run.metadata["joints"]]
    driven = [replace(m, metadata=m.metadata | {"joints": joints}) for m in (run, other)]
    with pytest.raises(InputError, match=r'elbow is 0 N·m .* has drive = "none"'):
        identify(driven)

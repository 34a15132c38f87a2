"""A joint whose torque was not recorded: its motion is a known input of the other equations."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from pipelines.contracts import RECORDING
from pipelines.contracts.table import Table
from pipelines.errors import ContractError, InputError
from pipelines.estimation.estimators import estimator_named
from pipelines.estimation.regression import away_from_turns
from pipelines.identification import identify
from pipelines.identification.extension import Extension, chosen
from pipelines.mechanics.kinematics import motion_table
from pipelines.mechanics.motion import motion_from_table
from pipelines.settings.filter import FilterSettings

X2, X3, COULOMB, VISCOUS, GRAVITY = 0.25, 0.8, 1.5, 0.6, 9.81
KNEE = [X2, X3, COULOMB, VISCOUS]
RATE_HZ = 200.0
COUNT = 2.0 * np.pi / 4096
"""Of an encoder of 12 bits, rad."""


def swing(seed):
    """Return time, angle, velocity and acceleration of a joint that swings about -0.8 rad."""
    draw = np.random.default_rng(seed)
    time = np.arange(round(20 * RATE_HZ)) / RATE_HZ
    q, dq, ddq = np.full(len(time), -0.8), np.zeros(len(time)), np.zeros(len(time))
    for hz, size in ((0.3, 0.35), (0.8, 0.15), (1.3, 0.08)):
        phase, rate = draw.uniform(0.0, 2.0 * np.pi), 2.0 * np.pi * hz
        q += size * np.sin(rate * time + phase)
        dq += size * rate * np.cos(rate * time + phase)
        ddq -= size * rate**2 * np.sin(rate * time + phase)
    return time, q, dq, ddq


def braked_leg(purpose, seed, hip_rad, hip_torque=None, gravity=GRAVITY, counts=0.0):
    """Return a recording of a leg whose hip is held by a brake: a pendulum about its knee."""
    draw = np.random.default_rng(1000 + seed)
    time, q, dq, ddq = swing(seed)
    torque = X2 * ddq + gravity * X3 * np.sin(hip_rad + q) + COULOMB * np.sign(dq) + VISCOUS * dq
    hip = np.full(len(time), hip_rad)
    # The encoder flickers between two counts, rad.
    hip += counts * draw.integers(0, 2, len(time))
    frame = pd.DataFrame(
        {
            "time_s": time,
            "hip_angle_rad": hip,
            "knee_angle_rad": q,
            "hip_torque_nm": np.nan if hip_torque is None else hip_torque,
            "knee_torque_nm": torque + 0.05 * draw.normal(size=len(time)),
        }
    )
    metadata = {
        "contract": "recording/1",
        "run": "exo_alone",
        "purpose": purpose,
        "sample_rate_hz": RATE_HZ,
        "joints": [{"name": "hip", "drive": "unmeasured"}, {"name": "knee"}],
        "geometry": {"thigh_length_m": 0.4, "gravity_m_s2": gravity},
    }
    return Table(frame, metadata, Path(f"{purpose}{seed}.parquet"))


def motions(cutoff_hz="auto", **changed):
    places = (("train", 1, 0.2), ("train", 2, -0.4), ("validate", 3, 0.5))
    tables = [braked_leg(*place, **changed) for place in places]
    settings = FilterSettings(cutoff_hz=cutoff_hz)
    return [motion_from_table(motion_table(table, settings)) for table in tables]


def braked_knee(purpose, seed, knee_rad):
    """Return the motion of a leg whose knee is held: a pendulum of an inertia of its own."""
    time, q, dq, ddq = swing(seed)
    angle = q + 0.8
    X1, X4, length = 1.4, 2.2, 0.4
    inertia = X1 + 2.0 * length * X3 * np.cos(knee_rad)
    weight = GRAVITY * (X4 * np.sin(angle) + X3 * np.sin(angle + knee_rad))
    torque = inertia * ddq + weight + COULOMB * np.sign(dq) + VISCOUS * dq
    frame = pd.DataFrame(
        {
            "time_s": time,
            "hip_angle_rad": angle,
            "knee_angle_rad": np.full(len(time), knee_rad),
            "hip_torque_nm": torque + 0.05 * np.random.default_rng(seed).normal(size=len(time)),
            "knee_torque_nm": np.nan,
        }
    )
    table = braked_leg(purpose, seed, 0.0)
    joints = [{"name": "hip"}, {"name": "knee", "drive": "unmeasured"}]
    held = replace(table, frame=frame, metadata=table.metadata | {"joints": joints})
    return motion_from_table(motion_table(held, FilterSettings()))


def with_joints(runs, *joints):
    return [replace(run, metadata=run.metadata | {"joints": list(joints)}) for run in runs]


@pytest.mark.parametrize("counts", [0.0, COUNT], ids=["still", "flickering encoder"])
def test_the_knee_is_identified_though_a_brake_holds_the_hip_at_other_angles(counts):
    found = identify(motions(counts=counts))
    assert np.allclose(found.parameters["value"], KNEE, rtol=0.02)
    assert list(found.parameters["name"]) == ["X2", "X3", "coulomb", "viscous"]
    assert set(found.validation.as_json()["all"]) == {"knee"}
    (remark,) = found.remarks
    assert remark.startswith("the torque of the hip was not measured")


def test_without_gravity_a_flickering_encoder_gives_no_coupling_of_the_links():
    """The knee's equation then has X3 only by the hip's velocity, which is noise alone."""
    found = identify(motions(gravity=0.0, counts=COUNT))
    assert list(found.parameters["name"]) == ["X2", "coulomb", "viscous"]
    assert np.allclose(found.parameters["value"], [X2, COULOMB, VISCOUS], rtol=0.02)


def test_the_hip_shows_the_coupling_where_the_knee_rests_at_another_angle_in_each_run():
    places = (("train", 1, 0.0), ("train", 2, -1.5), ("train", 4, -0.8), ("validate", 3, -0.4))
    table = identify([braked_knee(*place) for place in places]).parameters
    assert list(table["name"]) == ["X1", "X3", "X4", "coulomb", "viscous"]
    assert np.allclose(table["value"], [1.4, X3, 2.2, COULOMB, VISCOUS], rtol=0.02)


def test_a_flickering_encoder_of_a_held_joint_shows_no_turns():
    still, flickering = motions()[0], motions(counts=COUNT)[0]
    shares = [away_from_turns(motion).mean() for motion in (still, flickering)]
    assert shares[1] == pytest.approx(shares[0], abs=0.02) and shares[0] > 0.5


def test_a_load_converges_though_the_hip_s_own_inertia_is_unknown():
    runs = motions()
    terms = chosen(["load_dependent_friction@knee"], runs[0].machine, runs)
    (remark,) = identify(runs, extension=Extension().with_terms(terms)).remarks
    assert remark.startswith("the torque of the hip was not measured")


def test_a_torque_that_is_in_the_file_is_ignored_at_such_a_joint():
    without = identify(motions()).parameters
    anything = 30.0 * np.random.default_rng(5).normal(size=round(20 * RATE_HZ))
    pd.testing.assert_frame_equal(identify(motions(hip_torque=anything)).parameters, without)


@pytest.mark.parametrize("method", ["irls", "ols"])
def test_every_method_that_fits_equations_recovers_the_knee(method):
    found = identify(motions(), estimator_named(method))
    assert np.allclose(found.parameters["value"], KNEE, rtol=0.02)


@pytest.mark.parametrize("method", ["realizable", "oe", "iv"])
def test_methods_that_need_every_torque_say_so(method):
    said = r"the torque of the hip was not measured.* This method needs a machine whose joints all"
    with pytest.raises(InputError, match=said):
        identify(motions(), estimator_named(method))


def test_a_machine_without_any_measured_torque_is_refused():
    joints = [{"name": name, "drive": "unmeasured"} for name in ("hip", "knee")]
    with pytest.raises(InputError, match=r"no joint of .* has a measured torque"):
        identify(with_joints(motions(), *joints))


def test_a_measured_joint_that_rests_is_refused_with_both_ways_out():
    runs = with_joints(motions(hip_torque=np.arange(4000.0)), {"name": "hip"}, {"name": "knee"})
    with pytest.raises(InputError, match=r'drive = "unmeasured" if its angle matters, or leave it'):
        identify(runs)


def test_a_torque_may_be_missing_only_at_a_joint_that_says_so(tmp_path):
    table = braked_leg("train", 1, 0.2)
    RECORDING.write(tmp_path / "kept.parquet", table.frame, table.metadata)
    metadata = table.metadata | {"joints": [{"name": "hip"}, {"name": "knee"}]}
    with pytest.raises(ContractError, match="hip_torque_nm, row 0: found NaN"):
        RECORDING.write(tmp_path / "refused.parquet", table.frame, metadata)

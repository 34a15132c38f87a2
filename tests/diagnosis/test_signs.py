"""A reversed sign at a machine of one joint is a fault of acquisition; a machine wired as it should
be has none."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from pipelines.diagnosis.data_faults import find_faults
from pipelines.diagnosis.diagnose import diagnose
from pipelines.diagnosis.verdict.verdict import verdict
from pipelines.mechanics.kinematics import motion_table
from pipelines.mechanics.motion import motion_from_table
from pipelines.mechanics.scale import on_one_scale
from pipelines.settings.filter import FilterSettings
from tests.diagnosis.machines import lift, pendulum, slide

EFFORT, PLACE = ("_torque_nm", "_force_n"), ("_angle_rad", "_position_m")
MACHINES = [pendulum, slide, lift]


@cache
def recorded(machine, purpose, seed, **hidden):
    return machine(purpose, seed, **hidden)


def motions(machine, spoil=lambda frame: frame, **hidden):
    runs = []
    for number, purpose in enumerate(("train", "validate")):
        table = recorded(machine, purpose, number + 1, **hidden)
        runs.append(
            motion_from_table(
                motion_table(replace(table, frame=spoil(table.frame)), FilterSettings())
            )
        )
    return on_one_scale([replace(m, file=f"{m.purpose}.parquet") for m in runs])


def reversed_in(endings):
    def spoil(frame):
        return frame.assign(
            **{name: -frame[name] for name in frame.columns if name.endswith(endings)}
        )

    return spoil


def late_by(samples):
    def spoil(frame):
        return frame.assign(
            **{
                name: np.roll(frame[name], samples)
                for name in frame.columns
                if name.endswith(EFFORT)
            }
        )

    return spoil


@pytest.mark.parametrize("machine", MACHINES)
@pytest.mark.parametrize("endings", [EFFORT, PLACE], ids=["torque", "angle"])
def test_a_reversed_sign_is_named_in_each_run_of_a_machine_of_one_joint(machine, endings):
    faults = find_faults(motions(machine, reversed_in(endings)))
    assert [fault.file for fault in faults] == ["train.parquet", "validate.parquet"]
    for fault in faults:
        assert fault.spoils and fault.channel.endswith(EFFORT)
        assert (
            f"the sign of {fault.channel} is reversed" in fault.what
            and "looks the same" in fault.what
        )


def test_a_reversed_sign_in_one_run_of_two_is_named_there_alone():
    first, second = motions(slide)
    assert [f.file for f in find_faults([first, replace(second, torque=-second.torque)])] == [
        "validate.parquet"
    ]


@pytest.mark.parametrize("machine", MACHINES)
def test_a_machine_wired_as_it_should_be_is_never_reported_as_reversed(machine):
    assert find_faults(motions(machine)) == []


@pytest.mark.parametrize(
    ("machine", "hidden"),
    [(pendulum, {"spring": 0.8}), (slide, {"asymmetry": -80.0}), (lift, {"spring": 220.0})],
)
def test_what_a_machine_hides_is_no_reversed_sign(machine, hidden):
    assert find_faults(motions(machine, **hidden)) == []


@pytest.mark.parametrize("machine", MACHINES)
def test_a_torque_that_comes_late_is_no_reversed_sign(machine):
    assert find_faults(motions(machine, late_by(10))) == []


def test_no_physics_is_blamed_for_a_reversed_sign():
    outcome = verdict(diagnose(motions(slide, reversed_in(EFFORT), asymmetry=-80.0)))
    assert outcome["acquisition_at_fault"] and outcome["causes"] == []
    assert outcome["summary"].startswith(
        "Acquisition, not physics: train.parquet, axis_force_n: the sign of axis_force_n"
    )

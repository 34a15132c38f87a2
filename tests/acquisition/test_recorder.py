"""Recorder mode: the drives sample by themselves, faster than set-points come, and every sample is drained."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pipelines.acquisition import sampling
from pipelines.errors import DeviceError
from pipelines.mechanics.trajectory import read_trajectory
from pipelines.rig.server import Drive

LOCKSTEP = {'clock = "real_time"': 'clock = "lockstep"'}
QUEUE = {
    'newest = { address = 120, type = "uint32" }\naddress = 1000\ncapacity = 2048\n': "fifo = 1000\n",
}  # fmt: skip


@pytest.mark.parametrize("drain", [{}, QUEUE], ids=["ring", "queue"])
def test_a_set_point_every_fifth_sample_records_every_sample_of_the_run(record, excitation, drain):
    table = record(shipped="recorder", watchdog_s=20.0, replace=LOCKSTEP | drain)
    frame = table.frame
    assert (len(frame), table.metadata["sample_rate_hz"], table.metadata["gaps"]) == (1000, 1000.0, [])
    assert np.diff(frame["sequence"]).tolist() == [1] * 999
    assert_allclose(frame["time_s"], np.arange(1000) / 1000, atol=2e-6)
    # In straight lines from one set-point to the next.
    wanted = read_trajectory(excitation).at(frame["time_s"].to_numpy() + 0.5 / 1000)[0]
    assert_allclose(frame[["hip_reference_rad", "knee_reference_rad"]], wanted, atol=3e-4)
    assert_allclose(frame["hip_angle_rad"], frame["hip_reference_rad"], atol=0.1)


def test_recorded_and_cyclic_samples_tell_the_same_motion(record):
    silent = {"ripple_nm": "[0.0, 0.0]"}
    often = record(shipped="recorder", watchdog_s=20.0, replace=LOCKSTEP, **silent).frame
    seldom = record(shipped="plain", **silent).frame
    for joint in ("hip", "knee"):
        angle = np.interp(seldom["time_s"], often["time_s"], often[f"{joint}_angle_rad"])
        assert_allclose(angle, seldom[f"{joint}_angle_rad"], atol=5e-4)


def test_cuff_forces_stand_at_the_cycles_samples_and_nowhere_between(record):
    frame = record(shipped="recorder", watchdog_s=20.0, run="with_human", replace=LOCKSTEP).frame
    read = frame["thigh_back_force_y_n"].notna()
    assert read.sum() == 200
    assert set(np.diff(np.flatnonzero(read))) == {5}


def test_what_a_drive_overwrote_before_it_was_drained_is_a_gap_and_the_rest_is_right(record, monkeypatch):
    whole = record(shipped="recorder", watchdog_s=20.0, replace=LOCKSTEP).frame.set_index("sequence")
    rows, asleep = sampling.Streams.rows, []

    async def sleepy(streams, row):
        if 300 < row.sequence < 340:  # cycles of 5 samples: more than the 64 of the ring
            asleep.append(row)
            return []
        return await rows(streams, row)

    monkeypatch.setattr(sampling.Streams, "rows", sleepy)
    table = record(shipped="recorder", watchdog_s=20.0, replace=LOCKSTEP | {"capacity = 2048": "capacity = 64"})
    assert asleep
    ((time, missed),) = table.metadata["gaps"]
    assert 100 < missed < 200
    assert len(table.frame) == 1000 - missed
    found = table.frame.set_index("sequence")
    assert_allclose(found, whole.loc[found.index], atol=2e-6)
    assert np.diff(found["time_s"]).max() == pytest.approx((missed + 1) / 1000, abs=2e-6)
    assert found["time_s"].to_numpy()[np.argmax(np.diff(found["time_s"]))] == pytest.approx(time - 1e-3, abs=2e-6)


def test_a_glitch_between_two_cycles_which_no_exchange_sees_ends_the_run(record, monkeypatch):
    values = Drive._values

    def glitch(drive, sample):
        told = values(drive, sample)
        if drive.joint == 1 and sample.sequence[0] == 1502:
            told["angle"] += 100.0
        return told

    monkeypatch.setattr(Drive, "_values", glitch)
    with pytest.raises(DeviceError, match=r"knee angle (99|100)\.\d+ rad is outside its limits"):
        record(shipped="recorder", watchdog_s=20.0, replace=LOCKSTEP)


def test_in_real_time_no_sample_is_lost_though_cycles_are(record):
    table = record(
        shipped="recorder", watchdog_s=3.0, run="with_human", duration_s=2.0, rate_hz=50.0, torque_nm=1e4,
        cuff_force_n=1e4,
        speed_rad_s=100.0, angle_rad="[-3.0, 3.0]",
        replace={"seed = 1 ": "sample_rate_hz = 50.0\nseed = 1 ", "capacity = 2048": "capacity = 4096"},
    )  # fmt: skip
    assert table.metadata["gaps"] == []
    assert np.diff(table.frame["sequence"]).tolist() == [1] * 1999
    assert_allclose(np.diff(table.frame["time_s"]), 1e-3, atol=2e-6)

"""Recorder mode: the drives sample by themselves, faster than set-points come, and every sample is
drained."""

import asyncio
import time
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pipelines.acquisition.acquire import acquire
from pipelines.acquisition.check.rings import check_rings
from pipelines.acquisition.check.survey import probes_of
from pipelines.acquisition.machine import drive_protocol, sampling
from pipelines.acquisition.machine.machine import Machine
from pipelines.contracts import RECORDING
from pipelines.errors import DeviceError, SettingsError
from pipelines.mechanics.trajectory import read_trajectory
from pipelines.rig import ring
from pipelines.rig.device import Drive
from pipelines.rig.ring import Ring
from pipelines.rig.servo import Servo
from pipelines.settings.acquire import RunSettings
from pipelines.settings.rig import load_rig
from tests.acquisition.conftest import free_port

pytestmark = [pytest.mark.usefixtures("any_rate"), pytest.mark.long]

LOCKSTEP = {'clock = "real_time"': 'clock = "lockstep"'}
QUEUE = {
    'newest = { address = 120, type = "uint32" }\naddress = 1000\ncapacity = 2048\n': (
        "fifo = 1000\n"
    ),
}


@pytest.fixture
def record_in_real_time(tmp_path, excitation, rig_file):
    """Record two seconds at 1 kHz with 50 set-points a second, which a busy computer can do too.

    The rig is a process of its own.
    """

    def run(run="exo_alone", **replace):
        # So slow a motion that set-points which are left out do not jerk the leg; that is not the
        # point here.
        excitation.write_text(
            excitation.read_text().replace("6.283185307179586", "1.2566370614359172")
        )
        changes = {"watchdog_s": 1.0, "torque_nm": 300.0, "cuff_force_n": 1e4, "speed_rad_s": 30.0}
        rig = rig_file(
            "recorder", replace={"embedded = false": "embedded = true", **replace}, **changes
        )
        settings = RunSettings(name="test", run=run, purpose="train", duration_s=2.0)
        acquire(rig, settings, excitation, tmp_path / "test.parquet", 50.0)
        return RECORDING.read(tmp_path / "test.parquet")

    return run


@pytest.mark.parametrize("drain", [{}, QUEUE], ids=["ring", "queue"])
def test_a_set_point_every_fifth_sample_records_every_sample_of_the_run(record, excitation, drain):
    table = record(shipped="recorder", watchdog_s=20.0, replace=LOCKSTEP | drain)
    frame = table.frame
    assert (len(frame), table.metadata["sample_rate_hz"], table.metadata["gaps"]) == (
        1000,
        1000.0,
        [],
    )
    assert np.diff(frame["sequence"]).tolist() == [1] * 999
    assert_allclose(frame["time_s"], np.arange(1000) / 1000, atol=2e-6)
    # In straight lines from one set-point to the next.
    wanted = read_trajectory(excitation).at(frame["time_s"].to_numpy() + 0.5 / 1000)[0]
    assert_allclose(frame[["hip_reference_rad", "knee_reference_rad"]], wanted, atol=3e-4)
    assert_allclose(frame["hip_angle_rad"], frame["hip_reference_rad"], atol=0.1)


@pytest.mark.parametrize("drain", [{}, QUEUE], ids=["ring", "queue"])
def test_a_set_point_every_fiftieth_sample_records_them_all_too(record, drain):
    rate = {"seed = 1 ": "sample_rate_hz = 20.0\nseed = 1 "}
    frame = record(
        shipped="recorder", rate_hz=20.0, watchdog_s=20.0, replace=LOCKSTEP | rate | drain
    ).frame
    assert np.diff(frame["sequence"]).tolist() == [1] * 999


def test_recorded_and_cyclic_samples_agree_on_the_motion(record):
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


def test_what_a_drive_overwrote_before_it_was_drained_is_a_gap_and_the_rest_is_right(
    record, monkeypatch
):
    whole = record(shipped="recorder", watchdog_s=20.0, replace=LOCKSTEP).frame.set_index(
        "sequence"
    )
    rows, asleep = sampling.AlignedSampling.rows, []

    async def sleepy(streams, row):
        if 300 < row.sequence < 340:  # cycles of 5 samples: more than the 64 of the ring
            asleep.append(row)
            return []
        return await rows(streams, row)

    monkeypatch.setattr(sampling.AlignedSampling, "rows", sleepy)
    table = record(
        shipped="recorder", watchdog_s=20.0, replace=LOCKSTEP | {"capacity = 2048": "capacity = 64"}
    )
    assert asleep
    ((time, missed),) = table.metadata["gaps"]
    assert 100 < missed < 200
    assert len(table.frame) == 1000 - missed
    rows = table.frame.set_index("sequence")
    assert_allclose(rows, whole.loc[rows.index], atol=2e-6)
    assert np.diff(rows["time_s"]).max() == pytest.approx((missed + 1) / 1000, abs=2e-6)
    assert rows["time_s"].to_numpy()[np.argmax(np.diff(rows["time_s"]))] == pytest.approx(
        time - 1e-3, abs=2e-6
    )


def test_a_glitch_between_two_cycles_which_no_exchange_sees_ends_the_run(record, monkeypatch):
    values = Drive._values

    def glitch(drive, sample):
        altered = values(drive, sample)
        if drive.joint == 1 and sample.sequence[0] == 1502:
            altered["angle"] += 100.0
        return altered

    monkeypatch.setattr(Drive, "_values", glitch)
    with pytest.raises(DeviceError, match=r"knee angle (99|100)\.\d+ rad is outside its limits"):
        record(shipped="recorder", watchdog_s=20.0, replace=LOCKSTEP)


def recorded_with(monkeypatch, record, damage, queue=False, watchdog_s=20.0):
    """Record a run in which the knee's own record holds something else than what it measured;
    return why it ends."""
    append = Ring.append

    def damaged(ring, sequence, values):
        if values["angle"] < 0.0:  # the knee's
            sequence, values = damage(sequence, dict(values))
        if values:
            append(ring, sequence, values)

    monkeypatch.setattr(Ring, "append", damaged)
    with pytest.raises(DeviceError) as caught:
        record(
            shipped="recorder", watchdog_s=watchdog_s, replace=LOCKSTEP | (QUEUE if queue else {})
        )
    return str(caught.value)


def at(number, **change):
    """Return a damage of one record, far into the recording."""

    def damage(sequence, values):
        if sequence == number:
            values |= {name: values[name] + by for name, by in change.items()}
        return sequence, values

    return damage


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (at(1502, angle=0.1), "its angle leapt from"),
        (
            at(1502, time=0.005),
            "its clock went on by 0.006000 s while its counter went on by 1 samples",
        ),
        (at(1502, time=-0.5), "its clock went from"),
        (at(1502, current=100.0), "knee torque"),
    ],
    ids=["angle", "clock ahead", "clock back", "current"],
)
def test_a_record_that_cannot_be_true_ends_the_run_and_all_before_it_is_a_recording(
    record, tmp_path, monkeypatch, damage, words
):
    assert words in recorded_with(monkeypatch, record, damage)
    frame = RECORDING.read(tmp_path / "test.aborted.parquet").frame
    assert 1480 < frame["sequence"].iloc[-1] < 1502  # those of one drain are judged together
    assert np.diff(frame["sequence"]).tolist() == [1] * (len(frame) - 1)


@pytest.mark.parametrize(
    ("bit", "words"), [(2**30, "its sample counter"), (2, "one of the two leapt")]
)
def test_a_record_of_a_queue_under_another_number_ends_the_run(
    record, tmp_path, monkeypatch, bit, words
):
    damage = at(1500, sequence=bit)
    assert words in recorded_with(monkeypatch, record, damage, queue=True)
    assert (
        1480 < RECORDING.read(tmp_path / "test.aborted.parquet").frame["sequence"].iloc[-1] < 1500
    )


def test_a_ring_that_stands_still_while_the_drive_counts_on_ends_the_run(
    record, tmp_path, monkeypatch
):
    def stands_still(sequence, values):
        return sequence, values if sequence <= 1500 else {}

    why = recorded_with(monkeypatch, record, stands_still, watchdog_s=0.5)
    assert "but its record brought none after 1500" in why
    assert RECORDING.read(tmp_path / "test.aborted.parquet").frame["sequence"].iloc[-1] == 1500


def test_in_real_time_no_sample_is_lost_though_cycles_are(record_in_real_time):
    table = record_in_real_time("with_human")
    assert table.metadata["gaps"] == []
    assert np.diff(table.frame["sequence"]).tolist() == [1] * 1999
    assert_allclose(np.diff(table.frame["time_s"]), 1e-3, atol=2e-6)


@pytest.fixture
def with_full_queues(rig_file, serve, excitation, monkeypatch):
    """Serve drives in real time whose queues nobody has read since they were switched on; do
    something with them."""
    excitation.write_text(excitation.read_text().replace("6.283185307179586", "1.2566370614359172"))
    monkeypatch.setattr(ring, "QUEUE_RECORDS", 250)
    # Slow, for a busy computer.
    slow = {
        "record_rate_hz = 1000.0": "record_rate_hz = 200.0",
        "[plant]\n": "[plant]\nsample_rate_hz = 40.0\n",
    }
    changes = {
        "watchdog_s": 1.0,
        "torque_nm": 300.0,
        "speed_rad_s": 30.0,
        "rest_rad": "[0.4, -0.6]",
        "control_s": 9.0,
    }

    def run(do):
        port = free_port()
        rig = rig_file("recorder", port, QUEUE | slow, **changes)
        with serve(rig, port) as served:
            queues = [drive.ring._queue for drive in served.rig.drives]
            while any(len(queue) < ring.QUEUE_RECORDS for queue in queues):
                time.sleep(0.1)
            return do(rig)

    return run


@pytest.fixture
def recorded_from_queues(with_full_queues, excitation, tmp_path):
    def run():
        settings = RunSettings(name="test", run="exo_alone", purpose="train", duration_s=1.0)
        with_full_queues(
            lambda rig: acquire(rig, settings, excitation, tmp_path / "test.parquet", 40.0)
        )
        return RECORDING.read(tmp_path / "test.parquet")

    return run


def test_queues_that_are_full_before_the_run_are_emptied_first(recorded_from_queues):
    table = recorded_from_queues()
    assert table.metadata["gaps"] == []
    assert np.diff(table.frame["sequence"]).tolist() == [1] * 199


def test_what_comes_to_a_queue_while_the_drives_take_their_time_to_be_enabled_is_let_go(
    recorded_from_queues, monkeypatch
):
    since, enabled = {}, Servo.enabled.fget

    def slowly(servo):
        if not enabled(servo):
            return False
        return time.monotonic() > since.setdefault(servo, time.monotonic()) + 1.15

    monkeypatch.setattr(Servo, "enabled", property(slowly))
    assert recorded_from_queues().metadata["gaps"] == []
    assert since


def test_a_check_empties_full_queues_first(with_full_queues):
    async def checked(path):
        rig = Machine(load_rig(path), with_sensors=False, samples_per_cycle=5)
        await rig.connect()
        try:
            return await check_rings(rig, probes_of(rig), 40.0)
        finally:
            rig.close()

    assert with_full_queues(lambda path: asyncio.run(checked(path))) == []


def test_a_queue_that_fills_faster_than_it_is_read_is_refused_before_the_drives_are_enabled(
    record, monkeypatch
):
    served = []
    monkeypatch.setattr(drive_protocol, "EMPTYING_S", 0.2)
    monkeypatch.setattr(Ring, "take", lambda ring: [0] * 30)
    monkeypatch.setattr(Servo, "receive", lambda servo, reference, control: served.append(control))
    with pytest.raises(
        DeviceError, match=r"drive hip .*: its queue is not empty after 0\.2 s .* record less often"
    ):
        record(shipped="recorder", watchdog_s=20.0, replace=LOCKSTEP | QUEUE)
    assert set(served) == {0}  # disabled


def test_drifting_clocks_are_detected_corrected_and_reported(record_in_real_time):
    drift = {
        "seed = 1 ": "clock_ppm = [0.0, 40.0]\nclock_offset_s = [3.0, 12.345]\nseed = 1 ",
        'sampling = "recorder"': 'clocks = "own"\nsampling = "recorder"',
    }
    table = record_in_real_time(**drift)
    assert table.metadata["gaps"] == []
    assert np.diff(table.frame["sequence"]).tolist() == [1] * 1999
    knee = table.metadata["clocks"]["knee"]
    assert knee["corrected"]
    # The knee's clock gains on the hip's from the rig's start on, which is seconds away at most: 1
    # ms is 25 s of it.
    assert abs(knee["offset_s"] - 9.345) < 3 * knee["offset_error_s"] + 1e-3
    assert abs(knee["rate_ppm"] - 40.0) < 3 * knee["rate_error_ppm"]


@pytest.mark.parametrize(
    "replace",
    [
        {'clock = "lockstep"': 'clock = "lockstep"\nclocks = "own"'},
        {"seed = 1 ": "clock_ppm = [0.0, 1.0]\nseed = 1 "},
    ],
)
def test_clocks_that_drift_while_no_time_goes_by_are_refused(rig_file, replace):
    with pytest.raises(SettingsError, match='clock: found "lockstep", in which no time goes by'):
        load_rig(rig_file("plain", replace=replace))


class SlowRecord:
    """A drive whose record takes a whole cycle to be drained."""

    in_lockstep = False

    def __init__(self):
        self.ring, self.begun = SimpleNamespace(block=10), []

    async def drain(self, newest):
        self.begun.append(newest)
        await asyncio.sleep(0)
        return [SimpleNamespace(sequence=newest)]


def test_a_record_is_drained_in_each_cycle_in_addition_to_the_set_points():
    async def run():
        drive, brought = SlowRecord(), []
        recorded = sampling.RecorderSource(drive)
        for newest in range(0, 100, 10):
            brought += [
                sample.sequence
                for sample in await recorded.samples(SimpleNamespace(sequence=newest))
            ]
            await asyncio.sleep(0.001)
        recorded.pending.end()
        return drive.begun, brought

    begun, brought = asyncio.run(run())
    assert begun == list(range(0, 100, 10))
    assert brought == begun[:-1]


RING_CURRENT = 'current = { address = 7, type = "int16", scale = 1.0'
RING_ANGLE = 'angle = { address = 4, type = "int32", scale = 1e-6'


@pytest.mark.parametrize(
    ("right", "wrong", "what"),
    [
        (RING_CURRENT, RING_CURRENT.replace("1.0", "-1.0"), "torque"),
        (RING_CURRENT, RING_CURRENT.replace("1.0", "0.5"), "torque"),
        (RING_ANGLE, f"{RING_ANGLE}, offset = 0.05", "angle"),
    ],
)
def test_a_record_that_contradicts_the_exchanges_of_its_samples_ends_the_run(
    record, right, wrong, what
):
    with pytest.raises(DeviceError, match=rf"reports (a )?{what} .* while its own record holds"):
        record(shipped="recorder", replace=LOCKSTEP, believed={right: wrong})

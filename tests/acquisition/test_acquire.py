"""Recording on a virtual rig, over real Modbus TCP."""

import signal
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pipelines.acquisition.acquire import acquire
from pipelines.acquisition.recording.journal import Journal
from pipelines.acquisition.recording.journal_file import refuse_leftover
from pipelines.acquisition.recording.recording import write_recording
from pipelines.contracts import RECORDING
from pipelines.contracts.run_paths import journal_of
from pipelines.errors import InputError
from pipelines.mechanics.mechanisms.leg import cuff_torque
from pipelines.mechanics.motion import CUFFS, geometry_of
from pipelines.mechanics.trajectory import read_trajectory
from pipelines.rig.plant import Plant
from pipelines.rig.record import record as record_by_arrays
from pipelines.settings.acquire import RunSettings
from pipelines.settings.rig import load_rig


def test_equal_seeds_give_equal_recordings(record):
    first, second, other = (record(run="with_human", seed=seed).frame for seed in (1, 1, 2))
    assert first.equals(second)
    assert not np.array_equal(first["hip_torque_nm"], other["hip_torque_nm"])


def test_every_sample_of_the_run_is_there_and_tells_its_time(record):
    table = record(duration_s=2.0)
    assert len(table.frame) == 400
    assert np.diff(table.frame["sequence"]).tolist() == [1] * 399
    assert_allclose(table.frame["time_s"], np.arange(400) / 200, atol=2e-6)
    assert table.metadata["gaps"] == []
    assert table.metadata["period_s"] == pytest.approx(1.0)


def test_a_recording_names_the_excited_lines_of_a_motion_with_detection_lines(record, excitation):
    assert "excited_lines" not in record().metadata
    excitation.write_text(
        'unit = "deg"\nomega_rad_s = 6.283185307179586\ntheta0_rad = [0.65, -0.93]\n'
        "a = [[5, 0, 0, 0, 1], [6, 0, 0, 0, 0]]\nb = [[0, 0, 0, 0, 0], [0, 0, 0, 0, 1]]\n"
    )
    assert record().metadata["excited_lines"] == [1, 5]


def test_a_signal_that_comes_too_late_to_stop_a_run_lets_no_other_begin(
    record, monkeypatch, tmp_path
):
    def interrupted(*given):
        signal.raise_signal(signal.SIGINT)
        write_recording(*given)

    monkeypatch.setattr("pipelines.acquisition.run_outcome.write_recording", interrupted)
    with pytest.raises(KeyboardInterrupt):
        record()
    assert [len(RECORDING.read(path).frame) for path in tmp_path.rglob("*.parquet")] == [200]


def test_a_recording_that_came_while_somebody_was_asked_is_not_replaced(record, tmp_path):
    output, served = tmp_path / "test.parquet", []

    def claim():
        with pytest.raises(InputError, match="another run is recording there now"):
            refuse_leftover(journal_of(output))
        output.write_text("of another run")
        raise InputError("not overwritten")

    with pytest.raises(InputError, match="not overwritten"):
        record(hooks={"claim": claim}, served_as=served)
    assert output.read_text() == "of another run"
    assert not journal_of(output).exists()
    assert not any(drive.servo.enabled for drive in served[0].rig.drives)


def test_a_run_that_another_one_was_faster_than_says_so(record, tmp_path):
    path = journal_of(tmp_path / "test.parquet")
    others = []

    def begin(rig, trajectory):
        others.append(Journal(path, ["time_s"], {"run": "exo_alone"}))

    with pytest.raises(
        InputError, match=r"test\.parquet\.journal: another run is recording there now"
    ):
        record(hooks={"begin": begin})
    others[0].close()
    assert path.exists()


def test_the_recorded_set_points_are_the_trajectory_at_each_samples_end(record, excitation):
    frame = record(duration_s=1.0).frame
    wanted = read_trajectory(excitation).at(frame["time_s"].to_numpy() + 0.5 / 200)[0]
    assert_allclose(frame[["hip_reference_rad", "knee_reference_rad"]], wanted, atol=1e-6)


def test_over_modbus_and_by_arrays_the_leg_moves_alike(record, excitation, rig_file):
    silent = {"ripple_nm": "[0.0, 0.0]", "noise_n": 0.0, "settle_s": 1.0}
    over_modbus = record(run="with_human", duration_s=2.0, **silent).frame
    plant = Plant(load_rig(rig_file(**silent)).plant, "with_human")
    by_arrays, _ = record_by_arrays(plant, read_trajectory(excitation), 2.0)
    for quantity, tolerance in {"angle_rad": 1e-4, "reference_rad": 1e-6}.items():
        for joint in ("hip", "knee"):
            column = f"{joint}_{quantity}"
            assert_allclose(over_modbus[column], by_arrays[column], atol=tolerance)
    # Torque and force hang on single encoder counts and on set-points rounded to a microradian.
    assert np.std(over_modbus["knee_torque_nm"] - by_arrays["knee_torque_nm"]) < 0.1
    assert np.std(over_modbus["thigh_back_force_y_n"] - by_arrays["thigh_back_force_y_n"]) < 1.0


def test_cuff_forces_are_read_with_the_human_only_and_belong_to_their_sample(record):
    table = record(run="with_human", ripple_nm="[0.0, 0.0]", noise_n=0.0)
    alone = record(run="exo_alone")
    assert not [column for column in alone.frame if "force" in column]
    forces = (
        table.frame[[column for column in table.frame if "force" in column]]
        .to_numpy()
        .reshape(-1, 4, 3)
    )
    q = table.stacked("angle")
    on_leg = cuff_torque(
        forces[:, :2].sum(axis=1), forces[:, 2:].sum(axis=1), q, geometry_of(table.metadata)
    )
    # What the drives deliver less what the leg takes is the exoskeleton's own: small, and in step
    # with the motion.
    own = table.stacked("torque") - on_leg
    assert (own.std(axis=0) < 0.8 * table.stacked("torque").std(axis=0)).all()


def test_sensors_read_every_fourth_cycle_take_turns_and_leave_the_rows_between_empty(record):
    frame = record(run="with_human", replace={'map = "force"': 'map = "force"\nevery = 4'}).frame
    read = frame[[f"{cuff}_force_y_n" for cuff in CUFFS]].notna().to_numpy()
    assert (read.sum(axis=0) == 50).all()
    for sensor in read.T:
        assert set(np.diff(np.flatnonzero(sensor))) == {4}
    assert (read.sum(axis=1) == 1).all()


def test_a_drive_that_tells_neither_speed_nor_set_point_is_recorded_all_the_same(record):
    frame = record(drop=("velocity = {", "reference = { address = 110", "temperature = {")).frame
    assert "hip_velocity_rad_s" not in frame
    assert_allclose(frame["hip_reference_rad"], frame["hip_angle_rad"], atol=0.1)


def test_real_time_samples_come_on_the_devices_clock(record):
    slow = {"seed = 1 ": "sample_rate_hz = 50.0\nseed = 1 "}
    # Missed samples jerk the leg: they shall be counted here, not end the run.
    table = record(
        shipped="real_time",
        run="with_human",
        duration_s=2.0,
        rate_hz=50.0,
        replace=slow,
        torque_nm=1e4,
        cuff_force_n=1e4,
        speed_rad_s=50.0,
    )
    frame, gaps = table.frame, table.metadata["gaps"]
    missed = sum(count for _, count in gaps)
    assert len(frame) + missed == 100
    # A computer that is busy with something else may miss some, and then says so.
    assert missed <= 10
    assert_allclose(np.diff(frame["time_s"]), np.diff(frame["sequence"]) / 50, atol=2e-6)
    # A sensor that is asked late finds the next sample, and has nothing new a cycle later.
    is_force = frame.columns.str.contains("_force_")
    assert frame.loc[:, ~is_force].notna().all(axis=None)
    assert frame.loc[:, is_force].isna().any(axis=1).sum() <= 10


@pytest.mark.skipif(
    not Path("/proc/self").exists(), reason="needs a folder in which nobody can write"
)
def test_a_folder_that_takes_no_recording_is_refused_before_anything_is_connected(
    rig_file, excitation
):
    run = RunSettings(name="test", run="exo_alone", purpose="train", duration_s=1.0)
    with pytest.raises(OSError) as refused:
        acquire(rig_file(port=1), run, excitation, Path("/proc/one.parquet"))
    assert refused.value.filename == "/proc"

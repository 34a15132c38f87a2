"""Faults of acquisition are named, and physics is not mistaken for one.

The plant's recordings are sound; each test spoils one in the way its name says.
"""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from pipelines.contracts.fault_kind import FaultKind
from pipelines.contracts.table import Table
from pipelines.diagnosis.data_faults import excluding, find_faults
from pipelines.diagnosis.data_faults.rigid_fit import averages
from pipelines.mechanics.fourier import FourierTrajectory
from pipelines.mechanics.kinematics import motion_table
from pipelines.mechanics.mechanisms.leg import LEG
from pipelines.mechanics.motion import CUFFS, Motion, motion_from_table
from pipelines.mechanics.read import read_motions
from pipelines.rig.plant import Plant
from pipelines.rig.record import record
from pipelines.settings.filter import FilterSettings
from pipelines.settings.rig.plant import PlantSettings
from tests.campaigns.blind.cases import case
from tests.campaigns.blind.examine import Folders, neutral_name, prepare
from tests.effects.catalogue import TERMS

RICH = FourierTrajectory(
    omega=0.2 * np.pi,
    theta0=np.array([0.65, -0.93]),
    a=np.array([[0.22, -0.16, 0.10], [0.12, 0.24, -0.11]]),
    b=np.array([[0.10, 0.12, -0.07], [-0.22, 0.08, 0.10]]),
)
"""Three harmonics that move both joints through most of their range."""
KINDS = ("exo_alone", "with_human")
SPOILED = 1
"""The run with the person, which has all channels."""
WITNESSES = ("hip_reference_rad", "knee_reference_rad", "sequence")
"""Columns that a lab may not have, and that give many a fault away."""


def recordings(settings: PlantSettings, seed: int = 0) -> list[tuple[pd.DataFrame, dict]]:
    return [
        record(Plant(settings, kind, seed=seed + i), RICH, 30.0) for i, kind in enumerate(KINDS)
    ]


def motion(frame: pd.DataFrame, metadata: dict, name: str) -> Motion:
    return motion_from_table(motion_table(Table(frame, metadata, Path(name)), FilterSettings()))


@pytest.fixture(scope="module")
def sound():
    return recordings(PlantSettings())


@pytest.fixture(params=[True, False], ids=["all_columns", "only_the_needed_columns"])
def session(request, sound):
    """Frames and metadata of a sound session that a test may spoil."""
    copies = [(frame.copy(), dict(metadata)) for frame, metadata in sound]
    if not request.param:
        copies = [
            (f.drop(columns=list(WITNESSES)), {k: v for k, v in m.items() if k != "controller"})
            for f, m in copies
        ]
    return copies


def faults_of(session):
    return find_faults(
        [motion(*run, f"{kind}.parquet") for run, kind in zip(session, KINDS, strict=True)]
    )


def only_fault(session):
    """Return the one fault, which must be the spoiled run's."""
    faults = faults_of(session)
    assert [fault.file for fault in faults] == ["with_human.parquet"], [
        fault.what for fault in faults
    ]
    return faults[0]


def test_a_sound_session_has_no_fault(session):
    assert faults_of(session) == []


def test_a_gap_is_named_with_its_length_and_place(session):
    frame, metadata = session[SPOILED]
    session[SPOILED] = frame.drop(index=range(2000, 2300)).reset_index(drop=True), metadata
    fault = only_fault(session)
    assert fault.channel == "time_s"
    assert "1 gap" in fault.what and "300 missing samples (1.50 s) after 10.00 s" in fault.what


def test_samples_dropped_one_by_one_are_counted_and_leave_the_run_usable(session):
    frame, metadata = session[SPOILED]
    lost = np.arange(50, len(frame) - 50, 40)
    session[SPOILED] = frame.drop(index=lost).reset_index(drop=True), metadata
    fault = only_fault(session)
    assert f"{len(lost)} dropped samples" in fault.what
    assert motion(*session[SPOILED], "x").valid.mean() > 0.9


def test_late_stamps_are_jitter_and_not_gaps(session):
    frame, _ = session[SPOILED]
    rng = np.random.default_rng(1)
    frame["time_s"] += np.minimum(rng.exponential(1e-3, len(frame)), 4.5e-3)
    fault = only_fault(session)
    assert (
        fault.what.startswith("clock jitter: irregular")
        and "only the stamps are wrong" in fault.what
    )


def uneven(frame, seed=3):
    """Return the frame as it would be had its samples been taken up to a fifth of a period late,
    stamps and all."""
    count = np.arange(len(frame))
    taken = count + np.random.default_rng(seed).uniform(0.0, 0.2, len(frame))
    sessions = {
        name: np.interp(taken, count, frame[name]) for name in frame.columns if name != "sequence"
    }
    return frame.assign(**sessions)


def test_samples_taken_unevenly_and_stamped_so_are_no_fault(session):
    """Angles are filtered, and errors averaged, over time: an even clock changes no answer."""
    frame, metadata = session[SPOILED]
    session[SPOILED] = uneven(frame), metadata
    assert faults_of(session) == []


def test_angles_too_coarse_to_show_wrong_stamps_are_too_coarse_to_suffer_from_them(
    session,
):
    frame, metadata = session[SPOILED]
    coarse = {
        name: np.round(frame[name] / 0.02) * 0.02 for name in ("hip_angle_rad", "knee_angle_rad")
    }
    late = frame["time_s"] + np.random.default_rng(4).uniform(0.0, 1e-3, len(frame))
    session[SPOILED] = frame.assign(**coarse, time_s=late), metadata
    fault = next(f for f in faults_of(session) if f.channel == "time_s")
    assert "too coarse to show" in fault.what and not fault.spoils


def test_stamps_that_are_wrong_by_less_than_the_angles_noise_spoil_nothing(session):
    frame, metadata = session[SPOILED]
    rng = np.random.default_rng(6)
    shaken = {
        name: frame[name] + rng.normal(0.0, 5e-4, len(frame))
        for name in ("hip_angle_rad", "knee_angle_rad")
    }
    late = frame["time_s"] + np.minimum(rng.exponential(4e-4, len(frame)), 4.5e-3)
    session[SPOILED] = frame.assign(**shaken, time_s=late), metadata
    fault = next(f for f in faults_of(session) if f.channel == "time_s")
    assert "only the stamps are wrong" in fault.what and not fault.spoils


def test_samples_taken_unevenly_under_even_stamps_are_jitter(session):
    frame, _ = session[SPOILED]
    count = np.arange(len(frame))
    taken = count + np.random.default_rng(2).normal(0.0, 0.2, len(frame))
    for name in set(frame.columns) - {"time_s", "sequence"}:
        frame[name] = np.interp(taken, count, frame[name])
    assert only_fault(session).what.startswith("clock jitter: the stamps are even")


def test_a_clock_five_percent_slow_is_named_with_the_true_rate(session):
    session[SPOILED][0]["time_s"] *= 1.05
    assert "190.48 Hz in place of 200 Hz" in only_fault(session).what


def test_a_rate_that_changes_within_the_run_is_no_wrong_clock(session):
    """Two thirds of the samples 5 % closer than the mean, the others further apart."""
    frame, metadata = session[SPOILED]
    steps = (
        np.where(np.arange(len(frame)) < 2 * len(frame) // 3, 0.95, 1.1)
        / metadata["sample_rate_hz"]
    )
    session[SPOILED] = (
        frame.drop(columns="sequence", errors="ignore").assign(time_s=np.cumsum(steps) - steps[0]),
        metadata,
    )
    assert not any("another rate" in fault.what for fault in faults_of(session))


@pytest.mark.parametrize(
    ("share", "reported"), [(0.26, False), (1 / (2 * np.pi), True), (np.pi / 180, True)]
)
def test_a_drive_that_follows_weakly_is_in_no_other_unit(sound, share, reported):
    frame, metadata = sound[SPOILED]
    weak = frame.assign(hip_angle_rad=frame["hip_reference_rad"] * share)
    session = [(weak, metadata) if number == SPOILED else run for number, run in enumerate(sound)]
    messages = [fault.what for fault in faults_of(session) if fault.channel == "hip_angle_rad"]
    assert any("in another unit" in what for what in messages) == reported


def test_a_joint_that_rests_on_its_friction_while_its_set_point_goes_is_in_no_other_unit(sound):
    frame, metadata = sound[SPOILED]
    creeps = frame.assign(hip_angle_rad=0.4 + np.radians(frame["hip_reference_rad"]))
    session = [(creeps, metadata) if number == SPOILED else run for number, run in enumerate(sound)]
    assert not any(
        "in another unit" in fault.what
        for fault in faults_of(session)
        if fault.channel == "hip_angle_rad"
    )


def test_a_counter_that_jumps_where_time_does_not_is_one_fault_and_no_missing_samples(sound):
    session = [(frame.copy(), metadata) for frame, metadata in sound]
    session[SPOILED][0].loc[3000:, "sequence"] += 40
    fault = only_fault(session)
    assert fault.channel == "sequence" and "disagree by more than 3 samples 1 time" in fault.what


def test_a_counter_that_starts_again_is_named(sound):
    session = [(frame.copy(), metadata) for frame, metadata in sound]
    session[SPOILED][0].loc[3000:, "sequence"] -= 3000
    fault = only_fault(session)
    assert fault.channel == "sequence" and "goes back 1 time, first at 15.00 s" in fault.what


def test_stale_rows_are_counted_and_marked(session):
    frame, _ = session[SPOILED]
    stale = np.arange(100, len(frame), 17)
    values = [name for name in frame.columns if name not in ("time_s", "sequence")]
    frame.loc[stale, values] = frame.loc[stale - 1, values].to_numpy()
    fault = only_fault(session)
    assert f"{len(stale)} repeated samples" in fault.what and fault.channel == "all channels"
    assert set(np.flatnonzero(fault.samples)) == set(stale)


@pytest.mark.parametrize("rows", [3, 9])
def test_rows_that_come_faster_than_new_values_are_stale_and_not_saturated(session, rows):
    frame, metadata = session[SPOILED]
    values = [name for name in frame.columns if name not in ("time_s", "sequence")]
    frame[values] = frame[values].iloc[np.arange(len(frame)) // rows * rows].to_numpy()
    fault = only_fault(session)
    assert fault.kind == FaultKind.STALE and fault.channel == "all channels"
    assert fault.samples.mean() == pytest.approx(1 - 1 / rows, abs=0.01)
    assert "wait for new data" in fault.what
    metadata["imported"] = "log.csv"
    assert '`keep = "new"`' in only_fault(session).what


@pytest.mark.parametrize("joint", ["hip", "knee"])
def test_a_stuck_encoder_is_named_and_its_samples_excluded(session, joint):
    frame, metadata = session[SPOILED]
    name = f"{joint}_angle_rad"
    frame.loc[2000:2600, name] = frame.loc[2000, name]
    fault = only_fault(session)
    assert fault.channel == name and "stuck" in fault.what
    assert fault.samples[2000:2601].all() and fault.samples.sum() < 800
    remaining = excluding([motion(frame, metadata, "with_human.parquet")], [fault])[0]
    assert not remaining.valid[2000:2601].any() and remaining.valid.sum() > 4500


def test_a_joint_that_never_moves_in_a_run_repeats_no_old_samples(sound):
    frame, metadata = sound[SPOILED]
    torque = frame["hip_torque_nm"].to_numpy().copy()
    torque[1::3] = torque[::3][: len(torque[1::3])]
    rests = frame.assign(hip_angle_rad=0.4, hip_torque_nm=torque)
    session = [(rests, metadata) if number == SPOILED else run for number, run in enumerate(sound)]
    assert not any("repeated samples" in fault.what for fault in faults_of(session))


def test_a_stuck_torque_is_not_taken_for_stale_samples(session):
    frame, _ = session[SPOILED]
    frame.loc[2000:2300, "knee_torque_nm"] = frame.loc[2000, "knee_torque_nm"]
    fault = only_fault(session)
    assert fault.channel == "knee_torque_nm" and "stuck" in fault.what


def test_one_drive_read_for_both_joints_is_named(session):
    frame, _ = session[SPOILED]
    frame["knee_torque_nm"] = frame["hip_torque_nm"]
    faults = faults_of(session)
    (copied,) = [fault for fault in faults if "equal in every sample" in fault.what]
    # The copy has no unit of its own that could be wrong.
    assert not any(fault.kind in ("unit", "swap") for fault in faults)
    assert (copied.file, copied.channel) == ("with_human.parquet", "knee_torque_nm")
    assert copied.what.startswith("hip_torque_nm and knee_torque_nm")


def test_a_clipped_torque_is_saturated_at_its_limit(session):
    frame, _ = session[SPOILED]
    limit = round(float(frame["hip_torque_nm"].abs().quantile(0.9)), 2)
    frame["hip_torque_nm"] = frame["hip_torque_nm"].clip(-limit, limit)
    fault = only_fault(session)
    assert (
        fault.channel == "hip_torque_nm"
        and "saturated" in fault.what
        and f"{limit:.4g} N·m" in fault.what
    )
    assert (frame["hip_torque_nm"].abs()[fault.samples] == limit).all()


def rounded(session, step):
    for frame, _ in session:
        for name in ("hip_torque_nm", "knee_torque_nm"):
            frame[name] = np.round(frame[name] / step) * step


@pytest.mark.parametrize("step", [0.5, 2.0, 6.0])
def test_a_torque_that_is_rounded_to_coarse_steps_is_no_fault(session, step):
    """It stands still for up to a second, comes back to its extremes, and often repeats while the
    angle does."""
    rounded(session, step)
    assert faults_of(session) == []


def test_an_angle_that_repeats_with_a_torque_in_coarse_steps_is_no_stale_row(session):
    """In a tenth of the samples the angle is the last one's; the torque is new, but rounded."""
    rounded(session, 4.0)
    frame, _ = session[SPOILED]
    again = np.random.default_rng(4).random(len(frame)) < 0.1
    frame["knee_angle_rad"] = frame["knee_angle_rad"].mask(again).ffill().bfill()
    assert [fault for fault in faults_of(session) if "stale" in fault.what] == []


def test_a_torque_in_coarse_steps_that_stops_is_stuck(session):
    rounded(session, 2.0)
    frame, _ = session[SPOILED]
    frame.loc[2000:3400, "knee_torque_nm"] = frame.loc[2000, "knee_torque_nm"]
    fault = only_fault(session)
    assert fault.channel == "knee_torque_nm" and "stuck: constant for 7" in fault.what
    assert fault.samples[2000:3401].all() and fault.samples.sum() < 1500


@pytest.mark.parametrize("joint", ["hip", "knee"])
@pytest.mark.parametrize("quantity", ["torque_nm", "angle_rad"])
def test_a_reversed_sign_is_named_at_its_channel(session, joint, quantity):
    name = f"{joint}_{quantity}"
    session[SPOILED][0][name] *= -1.0
    fault = only_fault(session)
    assert fault.channel == name and "reversed" in fault.what


def test_both_torques_reversed_are_distinguished_from_neither(session):
    session[SPOILED][0][["hip_torque_nm", "knee_torque_nm"]] *= -1.0
    assert "hip_torque_nm and knee_torque_nm is reversed" in only_fault(session).what


@pytest.mark.parametrize("quantity", ["torque_nm", "angle_rad"])
def test_exchanged_joints_are_named(session, quantity):
    frame, _ = session[SPOILED]
    names = [f"hip_{quantity}", f"knee_{quantity}"]
    frame[names] = frame[names[::-1]].to_numpy()
    assert f"{names[0]} and {names[1]} are swapped" in only_fault(session).what


@pytest.mark.parametrize(("factor", "unit"), [(1e3, "N·mm"), (1e2, "N·cm"), (1 / 9.80665, "kgf·m")])
@pytest.mark.parametrize("joint", ["hip", "knee"])
def test_a_torque_in_another_unit_is_named_with_the_unit(session, joint, factor, unit):
    name = f"{joint}_torque_nm"
    session[SPOILED][0][name] *= factor
    fault = only_fault(session)
    assert fault.channel == name and "unit" in fault.what
    assert unit in fault.what


def test_drag_at_a_hip_that_hides_its_shank_is_no_other_unit(tmp_path):
    """Drag leaves so much freedom that the hip may carry no shank at all; it carries one as
    well."""
    hidden, folders = case(160_008, "single", 8), Folders(tmp_path)
    prepare(hidden, folders)
    assert hidden.hidden == (("quadratic_drag", 0),)
    files = sorted(folders.recordings(neutral_name(hidden)).glob("*.parquet"))
    assert not find_faults(read_motions(files, FilterSettings(), None))


def test_an_angle_in_degrees_is_named(session):
    session[SPOILED][0]["knee_angle_rad"] *= 180 / np.pi
    fault = only_fault(session)
    assert fault.channel == "knee_angle_rad" and "degrees" in fault.what


def test_one_run_at_four_times_the_scale_of_its_like_is_named_without_any_other_witness():
    session = [record(Plant(PlantSettings(), "exo_alone", seed=i), RICH, 30.0) for i in range(2)]
    session = [
        (f.drop(columns=list(WITNESSES)), {k: v for k, v in m.items() if k != "controller"})
        for f, m in session
    ]
    session[SPOILED][0][["hip_torque_nm", "knee_torque_nm"]] *= 4.0
    faults = faults_of(session)
    assert [fault.channel for fault in faults] == ["hip_torque_nm", "knee_torque_nm"]
    assert all("unit" in fault.what and "another run" in fault.what for fault in faults)


def test_cuffs_that_all_say_the_same_all_along_are_named_and_left_out(session):
    frame, _ = session[SPOILED]
    forces = [f"{cuff}_force_{axis}_n" for cuff in CUFFS for axis in "xyz"]
    frame[forces] = 0.0
    fault = only_fault(session)
    assert "all twelve cuff forces" in fault.what and not fault.spoils
    motions = [motion(*run, f"{kind}.parquet") for run, kind in zip(session, KINDS, strict=True)]
    alone, with_human = excluding(motions, [fault])
    assert with_human.forces is None and alone.forces is motions[0].forces


def test_a_dead_force_channel_is_named(session):
    session[SPOILED][0]["shank_front_force_y_n"] = 0.0
    fault = only_fault(session)
    assert fault.channel == "shank_front_force_y_n" and "dead" in fault.what


def test_cuffs_of_thigh_and_shank_exchanged_are_named(session):
    frame, _ = session[SPOILED]
    names = [f"{cuff}_force_{axis}_n" for cuff in CUFFS for axis in "xyz"]
    frame[names] = frame[names[6:] + names[:6]].to_numpy()
    assert "thigh and shank are exchanged" in only_fault(session).what


@pytest.mark.parametrize("spoil", ["gain", "offset", "drift", "noise"])
def test_what_physics_can_do_to_a_torque_is_no_fault(session, spoil):
    frame, _ = session[SPOILED]
    torque = frame["knee_torque_nm"]
    frame["knee_torque_nm"] = {
        "gain": 1.3 * torque,
        "offset": torque + 3.0,
        "drift": torque + 0.1 * frame["time_s"],
        "noise": torque + np.random.default_rng(3).normal(0.0, 3.0, len(frame)),
    }[spoil]
    assert faults_of(session) == []


@pytest.mark.slow
@pytest.mark.parametrize(
    "term",
    [t for t in TERMS if t.effect.name not in ("rigid_body", "friction")],
    ids=lambda t: f"{t.effect.name}@{t.effect.joint}",
)
def test_no_effect_of_the_catalogue_is_taken_for_a_fault(term):
    session = [
        record(Plant(PlantSettings(), kind, i, (term,)), RICH, 30.0) for i, kind in enumerate(KINDS)
    ]
    assert [fault.what for fault in faults_of(session)] == []


def test_what_nature_allows_is_said_of_the_leg_that_moves(sound):
    """Wiring is judged by parameters that cannot be negative: the same leg, in other terms."""
    moved = motion(*sound[0], "exo_alone.parquet")
    run = averages(moved)
    X1, X2, X3, X4 = 1.5, 0.2, 0.4, 2.0
    leg = LEG.regressor(run.q, run.dq, run.ddq, moved.geometry) @ [X1, X2, X3, X4]
    np.testing.assert_allclose(run.body() @ [X1 - X2, X2, X3, X4], leg, atol=1e-12)

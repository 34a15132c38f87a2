"""Sessions that no diagnosis can be made of are refused in one line that says what to do."""

from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest

from pipelines.diagnosis.data_faults import find_faults
from pipelines.diagnosis.detectability.detectability import detectability_of_recorded
from pipelines.diagnosis.diagnose import diagnose
from pipelines.diagnosis.evidence.eligibility import refuse_unfit
from pipelines.diagnosis.evidence.prepared_runs import prepare
from pipelines.diagnosis.selection.selection import select
from pipelines.diagnosis.training_data import training_data
from pipelines.errors import InputError
from pipelines.estimation.regression import away_from_reversals
from pipelines.mechanics.kinematics import motion_table
from pipelines.mechanics.motion import motion_from_table
from pipelines.settings.filter import FilterSettings
from tests.diagnosis.sessions import recordings, session


@pytest.fixture(scope="module")
def motions():
    return session(seed=11)


def standing_knee(motion, measured):
    q, dq, ddq = motion.q.copy(), motion.dq.copy(), motion.ddq.copy()
    q[:, 1], dq[:, 1], ddq[:, 1] = measured, 0.0, 0.0
    return replace(motion, q=q, dq=dq, ddq=ddq, measured_angle=q)


def imported(motion):
    return replace(motion, metadata=motion.metadata | {"imported": {"source": "log.csv"}})


@pytest.mark.parametrize("work", [diagnose, detectability_of_recorded])
def test_a_joint_that_never_moves_is_named(motions, work):
    with pytest.raises(
        InputError,
        match=(
            r"run_0.parquet: the knee moves for 0.0 s .* expected 5 s in the exo_alone runs to"
            r" train"
        ),
    ):
        work([standing_knee(m, -0.5 + 1e-6 * (np.arange(len(m)) % 2)) for m in motions])


def test_where_a_moved_joint_seems_to_stand_the_message_asks_to_check_its_units(motions):
    standing = [standing_knee(m, -0.5 + 1e-6 * (np.arange(len(m)) % 2)) for m in motions]
    with pytest.raises(
        InputError, match=r"its encoder, and the units of angle and time in the rig file$"
    ):
        diagnose(standing)
    with pytest.raises(
        InputError, match=r"its encoder, and the units of angle and time in the map$"
    ):
        diagnose([imported(m) for m in standing])


def test_a_constant_angle_is_reported_as_constant(motions):
    with pytest.raises(InputError) as refused:
        diagnose([imported(standing_knee(m, -0.5)) for m in motions])
    assert (
        str(refused.value)
        == "run_0.parquet: the angle of the knee is -0.5 rad in every row, expected a joint that"
        " moves; check its encoder, and which channel the map reads; for a joint that rests in all"
        ' runs set drive = "unmeasured" if its angle matters, or leave it out'
    )


@pytest.mark.parametrize("shake", [0.0, 1e-6])
def test_a_joint_that_rests_in_the_only_validation_run_is_not_to_leave_the_map(motions, shake):
    """It moves in the training runs; the way out is another run to validate on."""
    angle = -0.5 + shake * (np.arange(len(motions[0])) % 2)
    only = [m for m in motions if m.purpose != "validate"]
    resting = next(m for m in motions if m.purpose == "validate" and m.run == "exo_alone")
    resting = replace(standing_knee(resting, angle[: len(resting)]))
    with pytest.raises(
        InputError, match=r"or validate on a run in which it moves, as in run_0"
    ) as e:
        diagnose([imported(m) for m in (*only, resting)])
    assert "out of the map" not in str(e.value)


@pytest.mark.parametrize(
    ("value", "remedy"),
    [(0.0, '; a joint without a drive has drive = "none"'), (-3.2, "")],
)
def test_a_constant_torque_is_reported_as_constant(motions, value, remedy):
    with pytest.raises(InputError) as refused:
        diagnose(
            [imported(replace(m, torque=m.torque * [1.0, 0.0] + [0.0, value])) for m in motions]
        )
    assert (
        f": the torque of the knee is {value:.4g} N·m in every row, expected one that varies"
        in str(refused.value)
    )
    assert str(refused.value).endswith(
        f"Check that the drive was on, and which channel the map reads{remedy}"
    )


@pytest.mark.parametrize("times", [1.0, -1.0, 57.3])
def test_joints_that_hold_one_angle_between_them_are_refused(motions, times):
    def copied(motion):
        q = motion.measured_angle
        return replace(motion, measured_angle=np.column_stack([q[:, 0], 0.3 + times * q[:, 0]]))

    with pytest.raises(InputError) as refused:
        diagnose([imported(copied(m)) for m in motions])
    assert (
        str(refused.value)
        == f"run_0.parquet: the knee's angle is a copy of the hip's (factor {times:g}), expected an"
        " encoder column for each joint; correct their columns in the map"
    )


def test_a_session_of_imported_recordings_lacks_a_purpose_in_their_map(motions):
    with pytest.raises(
        InputError, match=r'give one of them purpose = "validate" in a \[\[recording\]\] of the map'
    ):
        diagnose([imported(m) for m in motions if m.purpose == "train"])


def test_two_seconds_with_the_human_are_not_made_up_for_by_a_long_run_without(motions):
    (short,) = [m for m in motions if (m.run, m.purpose) == ("with_human", "train")]
    short = replace(short, valid=short.valid & (short.time < 2.0))
    rest = [m for m in motions if m.file != short.file]
    with pytest.raises(
        InputError,
        match=rf"{short.file}: the hip moves for [01]\.\d s .* in the with_human runs to train",
    ):
        diagnose([*rest, short])


def test_a_run_is_not_validated_on_itself(motions):
    train = [m for m in motions if m.purpose == "train"]
    again = [replace(m, purpose="validate", file=f"copy_of_{m.file}") for m in train]
    with pytest.raises(
        InputError, match=rf"copy_of_{train[0].file} \(exo_alone, validate\) holds the same torques"
    ):
        diagnose([*train, *again])


def test_joints_that_take_turns_are_never_scored_and_refused(motions):
    half = [np.arange(len(m)) < len(m) // 2 for m in motions]
    taking_turns = [
        replace(m, dq=np.where(np.column_stack([first, ~first]), m.dq, 0.0))
        for m, first in zip(motions, half, strict=True)
    ]
    with pytest.raises(InputError, match=r"hip and knee move at once for 0.0 s"):
        diagnose(taking_turns)


@pytest.mark.parametrize(("together_s", "refused"), [(1.5, True), (2.5, False)])
def test_a_few_seconds_in_which_all_joints_move_at_once_suffice(motions, together_s, refused):
    """Simulated sessions with two to five of them had right verdicts or none, and no wrong one."""
    turns = []
    for motion in motions:
        moving = (away_from_reversals(motion) & motion.valid[:, np.newaxis]).all(axis=1)
        # Once both have moved for so long, each stands still for every other second.
        later = np.cumsum(moving) > together_s * motion.sample_rate_hz
        odd = np.floor(motion.time) % 2 == 1
        still = np.column_stack([later & odd, later & ~odd])
        turns.append(replace(motion, dq=np.where(still, 0.0, motion.dq)))
    expected = pytest.raises(InputError, match="move at once for 1") if refused else nullcontext()
    with expected:
        refuse_unfit(turns)


def test_mechanisms_that_exoid_does_not_know_are_refused(motions):
    telescope = {
        "joints": [{"name": "hip", "kind": "revolute"}, {"name": "knee", "kind": "prismatic"}]
    }
    strange = [replace(m, metadata=m.metadata | telescope) for m in motions]
    with pytest.raises(
        InputError,
        match=(
            r"has joints hip \(revolute\), knee \(prismatic\) and gravity 9\.8 m/s², expected those"
        ),
    ):
        diagnose(strange)


def test_runs_whose_joints_have_other_names_are_of_several_machines(motions):
    ankle = {"joints": [{"name": "hip", "kind": "revolute"}, {"name": "ankle", "kind": "revolute"}]}
    with pytest.raises(
        InputError, match=r"run_1.parquet has joints hip, ankle, run_0.parquet has hip, knee"
    ):
        diagnose(
            [motions[0], replace(motions[1], metadata=motions[1].metadata | ankle), *motions[2:]]
        )


def test_runs_of_two_machines_are_refused(motions):
    longer = replace(motions[1], geometry=replace(motions[1].geometry, thigh_length_m=0.5))
    with pytest.raises(
        InputError, match=r"run_1.parquet has thigh_length_m 0.5, run_0.parquet has 0.38952"
    ):
        diagnose([motions[0], longer, *motions[2:]])


def test_a_gap_is_left_out_and_does_not_forbid_to_speak_of_physics(motions):
    kept = (motions[1].time < 8.0) | (motions[1].time > 15.0)
    rows = {
        name: getattr(motions[1], name)[kept]
        for name in ("time", "q", "dq", "ddq", "torque", "valid", "sequence")
    }
    rows |= {
        name: getattr(motions[1], name)[kept]
        for name in ("measured_angle", "reference", "temperature")
    }
    gap = replace(motions[1], **rows, segment=np.where(rows["time"] < 8.0, 0, 1))
    (fault,) = find_faults([motions[0], gap, *motions[2:]])
    assert fault.file == "run_1.parquet" and "1 gap" in fault.what
    assert fault.samples is not None and not fault.samples.any()


def test_a_run_thinned_out_on_purpose_has_no_gaps(motions):
    thin = {
        name: getattr(motions[0], name)[::2]
        for name in ("time", "q", "dq", "ddq", "torque", "valid", "segment")
    }
    thin |= {
        name: getattr(motions[0], name)[::2] for name in ("sequence", "measured_angle", "reference")
    }
    assert find_faults([replace(motions[0], **thin, temperature=None, sample_rate_hz=100.0)]) == []


def test_where_a_fault_leaves_nothing_of_the_only_run_nothing_judges_it_and_the_run_is_refused(
    motions,
):
    torque = motions[0].torque.copy()
    torque[:, 1] = 3.0
    stuck = replace(motions[0], torque=torque)
    (fault,) = find_faults([stuck])
    # No sample can judge it.
    assert "stuck" in fault.what and fault.proof is None
    with pytest.raises(InputError, match="in every row"):
        training_data([stuck])


def test_a_run_that_a_fault_leaves_nothing_of_is_left_out_where_others_suffice(motions):
    torque = motions[0].torque.copy()
    torque[:, 1] = 3.0
    stuck = replace(motions[0], file="stuck.parquet", torque=torque)
    alone = [m for m in motions if m.run == "exo_alone"]
    (fault,) = find_faults([*alone, stuck])
    assert (
        fault.file == "stuck.parquet"
        and fault.what.endswith("; this run is left out")
        and not fault.spoils
    )
    with_it, without = diagnose([*alone, stuck]), diagnose(alone)
    assert with_it.causes == without.causes and with_it.status == without.status
    assert {run.motion.file for run in with_it.fitted_runs} == {
        run.motion.file for run in without.fitted_runs
    }


def with_gaps(motion, seed, share):
    """Leave out pieces of a quarter of a second at random, other ones in each period."""
    piece = round(0.25 * motion.sample_rate_hz)
    is_kept = np.random.default_rng(seed).random(len(motion) // piece + 1) < share
    return replace(motion, valid=motion.valid & np.repeat(is_kept, piece)[: len(motion)])


def test_where_gaps_leave_no_block_of_two_periods_the_noise_is_that_above_the_motion():
    runs = session(seed=11)
    found = diagnose(
        [with_gaps(m, k, 0.4) if m.purpose == "train" else m for k, m in enumerate(runs)]
    )
    assert not found.noise.from_periods
    assert found.status == "nothing_missing"


def test_what_is_too_short_to_show_its_noise_is_refused():
    data = training_data(session(seed=11))
    prepared = prepare(data.train, data.baseline)
    silent = replace(prepared.noise, density=np.full_like(prepared.noise.density, np.nan))
    with pytest.raises(InputError, match=r"blocks of the hip are usable, too few in any 20 s"):
        select(replace(prepared, noise=silent))


@pytest.mark.parametrize("factor", [1e-2, pytest.param(1e-6, marks=pytest.mark.slow)])
def test_torques_that_are_all_far_too_small_get_an_answer(motions, factor):
    alone = [m for m in motions if m.run == "exo_alone"]
    assert diagnose([replace(m, torque=factor * m.torque) for m in alone]).status


@pytest.mark.parametrize(("period_s", "taken"), [(4.0, 4.0), (1e6, None)])
def test_a_period_much_longer_than_its_recording_is_none(period_s, taken):
    assert motion_from_table(recorded(period_s)).period_s == taken


def test_a_period_of_less_than_four_samples_is_refused():
    with pytest.raises(
        InputError, match=r"period_s is 0.001 s, at \d+ Hz less than 4 samples, expected the period"
    ):
        motion_from_table(recorded(0.001))


def recorded(period_s):
    table = motion_table(recordings(seconds=20.0)[0], FilterSettings())
    return replace(table, metadata=table.metadata | {"period_s": period_s})

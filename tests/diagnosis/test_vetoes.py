"""A fault of acquisition stops the diagnosis only where mending it would change the answer."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from pipelines.contracts.fault_kind import FaultKind
from pipelines.diagnosis.data_faults import find_faults
from pipelines.diagnosis.data_faults.proof import Proof, Ruling
from pipelines.diagnosis.data_faults.sign_bit import _joined
from pipelines.diagnosis.diagnose import diagnose
from pipelines.diagnosis.training_data import training_data
from pipelines.diagnosis.verdict.verdict import verdict
from pipelines.errors import InputError, SettingsError
from pipelines.mechanics.motion import Motion
from pipelines.mechanics.scale import on_one_scale
from pipelines.settings.diagnose import DiagnoseSettings
from tests.diagnosis.machines import pendulum
from tests.diagnosis.sessions import session
from tests.diagnosis.test_signs import motions


@pytest.mark.parametrize(
    ("proof", "ruling"),
    [
        # Half of the error removed is too little, a little more is enough.
        (Proof(0.20, 0.101, 0.95), Ruling.CAVEAT),
        (Proof(0.20, 0.099, 0.95), Ruling.VETO),
        # The mended channel has to agree: most of an error that remains large proves nothing.
        (Proof(0.90, 0.20, 0.89), Ruling.CAVEAT),
        (Proof(0.90, 0.20, 0.91), Ruling.VETO),
        # Two wrong channels are less likely than one.
        (Proof(0.20, 0.06, 0.99, channels=2), Ruling.CAVEAT),
        (Proof(0.20, 0.04, 0.99, channels=2), Ruling.VETO),
        # What would double the error is no mend.
        (Proof(0.10, 0.19, 0.95), Ruling.CAVEAT),
        (Proof(0.10, 0.21, 0.95), Ruling.REFUTED),
    ],
)
def test_a_veto_needs_a_mend_that_removes_most_of_the_error_and_agrees(proof, ruling):
    assert proof.ruling is ruling


@pytest.fixture(scope="module")
def legs() -> list[Motion]:
    return session(seed=8)


def vetoes(motions):
    return [fault for fault in find_faults(motions) if fault.is_veto]


def test_a_veto_states_both_errors_and_the_key_that_overrules_it(legs):
    faults = vetoes([replace(m, torque=m.torque * [1.0, -1.0]) for m in legs])
    assert {fault.file for fault in faults} == {m.file for m in legs}
    for fault in faults:
        assert fault.kind is FaultKind.SIGN and "rig file" in fault.in_words
        assert "Mended" in fault.in_words and "as recorded" in fault.in_words
        assert '[diagnose] accept = ["sign"]' in fault.in_words


def test_the_message_about_an_imported_recording_names_the_key_of_the_map(legs):
    wrong = [
        replace(m, torque=m.torque * [1.0, -1.0], metadata=m.metadata | {"imported": {}})
        for m in legs
    ]
    assert all("`sign` in the map" in fault.in_words for fault in vetoes(wrong))


def test_an_accepted_veto_is_recorded_and_causes_are_sought(legs):
    alone = [m for m in legs if m.run == "exo_alone"]
    wrong = [replace(m, torque=m.torque * [1.0, -1.0]) for m in alone]
    outcome = verdict(diagnose(wrong, accept=(FaultKind.SIGN,)))
    assert outcome["accepted"] == ["sign"] and not outcome["acquisition_at_fault"]
    assert outcome["posterior"] is not None
    assert all(fault["veto"] for fault in outcome["data_faults"])
    assert any("accepted by [diagnose] accept" in caveat for caveat in outcome["caveats"])


def test_to_accept_another_kind_overrules_nothing(legs):
    wrong = [replace(m, torque=m.torque * [1.0, -1.0]) for m in legs]
    assert all(fault.spoils for fault in find_faults(wrong, [FaultKind.CLOCK]))


def test_a_kind_that_there_is_not_is_refused_with_the_list_of_all():
    with pytest.raises(SettingsError, match=r"'clock', 'stale'.*'cuffs'"):
        DiagnoseSettings().changed(accept=("colour",))


def test_a_clock_that_is_slow_in_every_run_is_a_caveat_and_physics_is_looked_at(legs):
    """Inertias absorb it: the error stays, and so does the answer."""
    slow = on_one_scale(
        [replace(m, file=m.file, time=m.time * 1.02, measured_angle=m.q) for m in legs]
    )
    faults = [fault for fault in find_faults(slow) if "another rate" in fault.what]
    assert faults and not any(fault.spoils for fault in faults)


def test_a_run_with_a_load_of_ten_times_the_weight_is_in_no_other_unit(legs):
    """Its friction is the same: another unit would have scaled that, too."""
    light, heavy = (replace(m, reference=None) for m in legs if m.run == "exo_alone")
    friction = 2.0 * np.sign(heavy.dq) + heavy.dq
    X = np.array([4.0, 1.0, 1.0, 3.0])
    A = heavy.machine.mechanism.regressor(heavy.q, heavy.dq, heavy.ddq, heavy.geometry) @ X
    B = light.machine.mechanism.regressor(light.q, light.dq, light.ddq, light.geometry) @ X
    noise = np.random.default_rng(1).normal(0.0, 0.3, heavy.torque.shape)
    loaded = replace(heavy, torque=10.0 * A + friction + noise)
    unloaded = replace(light, torque=B + 2.0 * np.sign(light.dq) + light.dq)
    assert vetoes([unloaded, loaded]) == []
    in_another_unit = replace(heavy, torque=10.0 * (A + friction + noise))
    assert {fault.kind for fault in vetoes([unloaded, in_another_unit])} == {FaultKind.UNIT}


def test_a_joint_that_is_hardly_driven_is_in_no_other_unit(legs):
    """Its torque is noise in one run, and half of it in the other."""
    rng = np.random.default_rng(2)
    follows = [
        replace(m, torque=np.column_stack([m.torque[:, 0], rng.normal(0.0, size, len(m.torque))]))
        for m, size in zip(legs, (0.05, 0.01, 0.05, 0.01), strict=False)
    ]
    assert not any(fault.kind is FaultKind.UNIT for fault in find_faults(follows))


def test_the_sign_of_one_run_is_not_reversed_where_the_others_predict_it(legs):
    runs = [m for m in legs if m.run == "exo_alone"]
    odd = replace(runs[1], torque=-runs[1].torque)
    assert {fault.file for fault in vetoes([runs[0], odd])} >= {odd.file}
    assert vetoes(runs) == []


@pytest.mark.parametrize("bit", [1.1, 2.0, 4.0])
@pytest.mark.parametrize("sign", [1.0, -1.0], ids=["unsigned", "reversed"])
def test_a_magnitude_with_a_sign_bit_is_named_for_what_it_is(bit, sign):
    wrong = []
    for m in motions(pendulum):
        limit = bit * np.abs(m.torque).max()
        wrong.append(replace(m, torque=sign * np.where(m.torque < 0, limit - m.torque, m.torque)))
    faults = vetoes(wrong)
    assert {fault.kind for fault in faults} == {FaultKind.SIGN_BIT}
    assert all("two branches" in fault.what for fault in faults)


def test_a_torque_that_never_changes_sign_has_one_branch():
    lifted = [replace(m, torque=m.torque + 1.5 * np.abs(m.torque).max()) for m in motions(pendulum)]
    assert not any(fault.kind is FaultKind.SIGN_BIT for fault in find_faults(lifted))


def test_only_a_branch_of_the_other_sign_that_jumps_is_joined_to_the_near_one():
    true = 20.0 * np.sin(np.linspace(0.0, 30.0, 3000))
    magnitude = np.where(true < 0, 64.0 - true, true)
    assert any(np.allclose(way, true, atol=0.3) for way in _joined(magnitude, magnitude > 32.0))
    # Turned round at half of its range, a torque of one sign is as smooth as before.
    positive = np.abs(true) + 5.0
    for limit in (12.5, 15.0):
        assert _joined(positive, positive > limit) == []


def test_a_run_that_is_stuck_nearly_throughout_is_judged_by_the_good_samples_of_the_others(legs):
    runs = [m for m in legs if m.run == "exo_alone"]
    first = runs[0]
    angle = first.measured_angle.copy()
    start = len(angle) // 10
    angle[start:, 0] = angle[start, 0]
    q, dq, ddq = first.q.copy(), first.dq.copy(), first.ddq.copy()
    q[start:, 0], dq[start:, 0], ddq[start:, 0] = angle[start, 0], 0.0, 0.0
    stuck = replace(first, measured_angle=angle, q=q, dq=dq, ddq=ddq)
    (fault,) = [f for f in find_faults([stuck, runs[1]]) if f.kind is FaultKind.STUCK]
    assert fault.is_veto and fault.proof.recorded > 2.0 * fault.proof.mended
    accepted = find_faults([stuck, runs[1]], [FaultKind.STUCK])
    assert not any(f.spoils for f in accepted) and any(f.accepted for f in accepted)


def held(frame, rows=20):
    """Return a recording whose values are read anew in every so many rows only."""
    values = [name for name in frame.columns if name not in ("time_s", "sequence")]
    latest = np.arange(len(frame)) // rows * rows
    return frame.assign(**{name: frame[name].to_numpy()[latest] for name in values})


def test_samples_that_leave_too_little_are_used_as_recorded_where_their_kind_is_accepted():
    runs = motions(pendulum, held, spring=1.0)
    with pytest.raises(InputError, match=r"correct first .* repeated samples \(95 %\)"):
        diagnose(runs)
    with pytest.raises(InputError, match="repeated samples"):
        diagnose(runs, accept=(FaultKind.CLOCK,))
    outcome = verdict(diagnose(runs, accept=(FaultKind.STALE,)))
    assert outcome["accepted"] == ["stale"] and not outcome["acquisition_at_fault"]
    assert outcome["status"] == "explained" and "parallel spring" in outcome["finding"]
    accepted = [c for c in outcome["caveats"] if 'accepted by [diagnose] accept = ["stale"]' in c]
    assert len(accepted) == len(runs)


def test_samples_whose_kind_is_accepted_are_left_out_all_the_same_where_enough_remain():
    runs = motions(pendulum, lambda frame: pd.concat([held(frame[:400]), frame[400:]]))
    data = training_data(runs, accept=[FaultKind.STALE])
    assert {fault.kind for fault in data.left_out} == {FaultKind.STALE}
    assert not data.doubts

"""A verdict on an arm whose elbow has no drive: what is missing shows in its balance."""

import numpy as np
import pytest

from pipelines.contracts.joints import Joint
from pipelines.diagnosis.candidates.smooth_laws import Spans, smooth_laws
from pipelines.diagnosis.diagnose import diagnose
from pipelines.diagnosis.verdict.candidate_table import candidates
from pipelines.diagnosis.verdict.verdict import verdict
from pipelines.effects import EFFECTS
from pipelines.effects.end_stop import EndStop
from pipelines.effects.parallel_spring import ParallelSpring
from pipelines.effects.passive_joint_torque import PassiveJointTorque
from pipelines.effects.position_dependent_friction import PositionDependentFriction
from pipelines.effects.torque_cross_talk import TorqueCrossTalk
from pipelines.effects.torque_gain import TorqueGain
from pipelines.effects.torque_offset import TorqueOffset
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.machine import machine_of
from tests.diagnosis.free_elbow import free_elbow, motion_of
from tests.diagnosis.screening import Screening


def runs(**hidden):
    return [
        motion_of(free_elbow(seed, seconds=24.0, **hidden), purpose)
        for seed, purpose in ((1, "train"), (2, "validate"))
    ]


def test_nothing_is_missing_of_it_and_its_drive_fixes_the_scale():
    diagnosis = diagnose(runs())
    assert diagnosis.status == "nothing_missing"
    table = candidates(diagnosis)
    absorbed = {tuple(causes) for causes in table.loc[table["verdict"] == "absorbed", "causes"]}
    assert ("torque_gain@shoulder",) in absorbed


def test_a_spring_at_the_free_elbow_is_named_with_its_size():
    outcome = verdict(diagnose(runs(spring=0.2)))
    (cause,) = outcome["causes"]
    assert (cause["effect"], cause["joint"]) == ("parallel_spring", "elbow")
    assert cause["parameters"][0]["value"] == pytest.approx(0.2, rel=0.05)
    assert outcome["data_faults"] == []


def test_a_passive_joint_has_no_effect_of_a_torque_sensor_and_an_endless_one_no_spring():
    arm = machine_of((Joint("shoulder"), Joint("elbow", drive="none")), Geometry())
    assert TorqueOffset.possible(arm) == ["shoulder"]
    assert TorqueGain.possible(arm) == []
    # The elbow's torque is zero, so the shoulder's channel cannot have a share of it.
    assert TorqueCrossTalk.possible(arm) == []
    table = machine_of((Joint("table", turns=True),), Geometry(gravity_m_s2=0.0))
    level = machine_of((Joint("table"),), Geometry(gravity_m_s2=0.0))
    differ = {effect for effect in EFFECTS if effect.possible(table) != effect.possible(level)}
    assert differ == {ParallelSpring, EndStop, PositionDependentFriction, PassiveJointTorque}


def test_no_law_of_a_load_is_sought_at_a_joint_without_a_drive():
    """What is predicted there is the residual: a gain on it would explain all of that."""
    prepared = Screening.of(runs()).prepared
    spans = Spans.of(prepared.runs, prepared.torque[:2])
    run = prepared.runs[0]
    laws, _ = smooth_laws(run, spans, np.ones_like(run.state[0]))
    of_load = {(law.kind, law.joint) for law in laws if "load" in law.kind or "gain" in law.kind}
    assert of_load == {("load", 0), ("gain_over_time", 0), ("other_load", 1)}
    # A constant gain of the drive, with bodies of nothing, would leave the elbow without a torque.
    constant = 1.0
    assert all(law.variance < constant for law in laws if law.kind == "gain_over_time")

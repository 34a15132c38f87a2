"""What stretches over two joints pulls at both as one elastic energy says, and is found as one
law."""

from dataclasses import replace

import numpy as np
import pytest

from pipelines.contracts.verdict import Verdict
from pipelines.diagnosis.candidates.smooth_laws import Spans, smooth_laws
from pipelines.diagnosis.diagnose import diagnose
from pipelines.diagnosis.verdict.verdict import verdict
from tests.diagnosis.screening import Screening
from tests.diagnosis.sessions import banded, diagnosed, session

STEP = 1e-5
LABEL = "law:across_joints"


@pytest.fixture(scope="module")
def prepared():
    return Screening.of(session()).prepared


def across(run, spans, q):
    """Return the torques of the law's parts, (m, 2, k) N·m, where a run's angles are others."""
    moved = replace(run, state=(q, *run.state[1:]))
    laws, columns = smooth_laws(moved, spans, np.zeros_like(q))
    return (
        columns[:, :, [law.kind == "across_joints" for law in laws]] * spans.torque[:, np.newaxis]
    )


def test_its_torques_are_the_slopes_of_an_energy(prepared):
    """So what the hip's torque changes with the knee's angle, the knee's does with the hip's."""
    run, spans = prepared.runs[0], Spans.of(prepared.runs, prepared.torque[:2])
    q = run.state[0]
    of_knee, of_hip = (
        (across(run, spans, q + step) - across(run, spans, q - step)) / (2.0 * STEP)
        for step in (np.array([0.0, STEP]), np.array([STEP, 0.0]))
    )
    largest = np.abs(of_hip).max()
    np.testing.assert_allclose(of_knee[:, 0], of_hip[:, 1], atol=1e-6 * largest)
    assert np.abs(of_hip[:, 1]).max() > 0.1 * largest


def test_a_part_is_of_order_one_at_the_joint_where_it_is_larger(prepared):
    spans = Spans.of(prepared.runs, prepared.torque[:2])
    rng = np.random.default_rng(0)
    run = prepared.runs[0]
    q = spans.middle + spans.half_range * rng.uniform(-1.0, 1.0, run.state[0].shape)
    rms = np.sqrt(np.mean(across(run, spans, q) ** 2, axis=0)) / spans.torque[:, np.newaxis]
    np.testing.assert_allclose(rms.max(axis=0), 1.0, atol=0.1)


@pytest.mark.slow
def test_a_band_across_both_joints_is_one_unlisted_law_of_no_single_joint():
    """A band from the pelvis to the shank that is slack in a part of its range: no spring of either
    joint."""
    outcome = verdict(diagnose(banded(session(seed=5))))
    assert outcome["status"] == "unknown_cause"
    (finding,) = outcome["findings"]
    assert (finding["joint"], finding["family"]) == (None, "angle")
    assert finding["laws"][0]["words"] == "an elastic torque across both joints"
    assert Verdict.model_validate(outcome).findings[0].laws[0].joint is None
    assert outcome["posterior"]["laws"][LABEL] > 0.9


def test_a_spring_of_one_joint_is_none():
    outcome = verdict(diagnosed("parallel_spring", "knee", seed=4, stiffness=6.0, rest_angle=-0.5))
    assert outcome["causes"][0]["effect"] == "parallel_spring"
    assert outcome["posterior"]["laws"].get(LABEL, 0.0) < 0.05


def test_a_law_of_both_angles_holds_any_smooth_torque_of_their_sum(prepared):
    """As gravity on the shank: its angle to the ground is the sum, whatever each joint's range."""
    run, spans = prepared.runs[0], Spans.of(prepared.runs, prepared.torque[:2])
    assert np.ptp(spans.half_range) > 0.05
    laws, columns = smooth_laws(run, spans, np.zeros_like(run.state[0]))
    for joint in range(2):
        own = [law.kind == "both_angles" and law.joint == joint for law in laws]
        wanted = np.sin(run.state[0].sum(axis=1))
        # A constant torque is another law's.
        parts = np.column_stack([columns[:, joint, own], np.ones(len(wanted))])
        rest = wanted - parts @ np.linalg.lstsq(parts, wanted, rcond=None)[0]
        assert np.std(rest) < 0.01 * np.std(wanted)

"""Detection lines: error rates of their tests, what hidden causes show there, and the verdict."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from matplotlib import pyplot as plt
from scipy.signal import lfilter
from scipy.stats import binom

from exoid_cli.console import console
from exoid_cli.verdict_view import show_verdict
from pipelines.contracts.joints import HIP_AND_KNEE
from pipelines.contracts.table import Table
from pipelines.contracts.verdict import Verdict
from pipelines.design.excitation import design
from pipelines.diagnosis.diagnose import diagnose
from pipelines.diagnosis.evidence.baseline_columns import columns_under
from pipelines.diagnosis.evidence.detection_lines import (
    Periods,
    changes,
    detection_lines,
    p_values,
    residual_lines,
)
from pipelines.diagnosis.evidence.observed_run import observe
from pipelines.diagnosis.evidence.prepared_runs import baseline_fit
from pipelines.diagnosis.training_data import training_data
from pipelines.diagnosis.verdict.figures import detection_lines as drawing
from pipelines.diagnosis.verdict.verdict import verdict
from pipelines.mechanics.kinematics import motion_table
from pipelines.mechanics.motion import motion_from_table
from pipelines.model import effect_named, term_from
from pipelines.report.sections.decision import decision
from pipelines.rig.plant import Plant
from pipelines.rig.record import record
from pipelines.settings.design import DesignSettings
from pipelines.settings.filter import FilterSettings
from pipelines.settings.rig.plant import PlantSettings
from pipelines.wording.detection_lines import HEADINGS, rows

pytestmark = pytest.mark.long

RUNS = [(run, purpose) for run in ("exo_alone", "with_human") for purpose in ("train", "validate")]


@cache
def multisine():
    settings = DesignSettings(criterion="multisine", harmonics=29, base_frequency_hz=0.05)
    return design(settings).trajectory


@cache
def session(effect=None, seconds=40.0, **values):
    """Return the motions of a leg along a multisine, an effect hidden at its knee."""
    hidden = [term_from(effect_named(effect)(joint="knee"), values)] if effect else []
    motions = []
    for number, (run, purpose) in enumerate(RUNS):
        plant = Plant(PlantSettings(), run, seed=10 + number, effects=hidden)
        frame, metadata = record(plant, multisine(), seconds, purpose)
        about = metadata | {"excited_lines": multisine().excited_lines}
        motion = motion_from_table(motion_table(Table(frame, about), FilterSettings()))
        motions.append(replace(motion, file=f"run_{number}.parquet"))
    return motions


@cache
def knee(effect=None, **values):
    """Return what the knee's lines show under the baseline, fitted to the training runs."""
    data = training_data(session(effect, **values), (), ())
    fitted = baseline_fit(data.train, data.baseline)[2]
    runs = [*data.train, *data.validate]
    residuals = [r.measured - columns_under((), r, data.baseline)[0] @ fitted for r in runs]
    return detection_lines(runs, residuals, None)[1]


def noise(rng, blocks, correlation_s):
    """Return stationary noise in blocks of 25 ms."""
    before = 4000
    white = rng.standard_normal(blocks + before)
    rho = np.exp(-0.025 / correlation_s) if correlation_s else 0.0
    return lfilter([np.sqrt(1.0 - rho**2)], [1.0, -rho], white)[before:]


def allowed(share, trials, inflated=1.5):
    """Return the number of rejections that a test of a somewhat higher rate hardly exceeds."""
    return binom.ppf(0.999, trials, inflated * share)


@pytest.mark.parametrize("correlation_s", [0.0, 0.02, 0.2, 2.0])
def test_noise_alone_is_rejected_about_as_often_as_the_level_says(correlation_s):
    run, rng, trials = observe(session()[0]), np.random.default_rng(5), 300
    p_of_trials = []
    for _ in range(trials):
        white = residual_lines([run], [noise(rng, len(run.time), correlation_s)], 0)[1]
        p = p_values(white)
        p_of_trials.append([p.excited, p.odd, p.even])
    for level in (0.05, 0.01):
        assert np.all(np.sum(np.array(p_of_trials) < level, axis=0) <= allowed(level, trials))
    # It is no test that never rejects, either.
    assert np.all(np.sum(np.array(p_of_trials) < 0.5, axis=0) > 0.4 * trials)


@pytest.mark.parametrize("correlation_s", [0.0, 0.2])
def test_noise_alone_shows_no_change_over_time(correlation_s):
    run, rng, trials = observe(session(seconds=60.0)[0]), np.random.default_rng(6), 200
    p = []
    for _ in range(trials):
        lines = residual_lines([run], [noise(rng, len(run.time), correlation_s)], 0)
        p.append(changes(*lines)[1])
    assert np.sum(np.array(p) < 0.05) <= allowed(0.05, trials)


def test_a_torque_that_grows_from_period_to_period_is_a_change():
    run, rng = observe(session(seconds=60.0)[0]), np.random.default_rng(7)
    wave = np.sin(2.0 * np.pi * 0.45 * run.time)
    growing = 0.3 * noise(rng, len(run.time), 0.0) + 0.5 * np.floor(run.time / 20.0) * wave
    steady = 0.3 * noise(rng, len(run.time), 0.0) + 0.5 * wave
    rms, p = changes(*residual_lines([run], [growing], 0))
    assert p < 1e-6
    # From 0 to 1 N·m within the run, away from reversals.
    assert rms == pytest.approx(np.sqrt(0.5), rel=0.25)
    assert changes(*residual_lines([run], [steady], 0))[1] > 0.01


def test_runs_of_two_periods_show_no_change():
    run = observe(session()[0])
    assert changes(*residual_lines([run], [run.measured[:, 0]], 0)) is None


@pytest.mark.parametrize(
    ("line", "shown", "hidden"),
    [(5, "excited", ("odd", "even")), (3, "odd", ("even",)), (10, "even", ("excited", "odd"))],
)
def test_a_line_in_the_noise_shows_in_its_own_class_and_not_in_others(line, shown, hidden):
    # Odd distortion is at excited lines as well.
    assert (5 in multisine().excited_lines) and (3 not in multisine().excited_lines)
    run, rng = observe(session()[0]), np.random.default_rng(8)
    wave = 0.6 * np.sin(2.0 * np.pi * 0.05 * line * run.time + 0.3)
    p = p_values(residual_lines([run], [wave + 0.5 * noise(rng, len(run.time), 0.02)], 0)[1])
    assert getattr(p, shown) < 1e-5
    assert all(getattr(p, name) > 0.01 for name in hidden)


def test_rms_of_lines_add_up_to_the_mean_square():
    run = observe(session()[0])
    periods = Periods.of(run, run.measured[:, 0])
    lines = periods.lines()
    varying = periods.values - periods.values.mean()
    # Above 12.5 Hz there is hardly any torque.
    assert np.mean(np.abs(lines.amplitude) ** 2 @ np.ones(len(lines.lines))) == pytest.approx(
        np.mean(varying**2), rel=0.01
    )


def test_a_leg_without_a_hidden_cause_distorts_as_its_model_predicts():
    lines = knee()
    assert lines.measured_nm.even > 10.0 * lines.noise_nm / np.sqrt(160 * lines.periods)
    assert lines.measured_nm.even == pytest.approx(lines.predicted_nm.even, rel=0.15)
    assert min(lines.p_value.excited, lines.p_value.odd, lines.p_value.even) > 0.005


def test_friction_that_differs_with_the_direction_is_even():
    lines = knee("viscous_asymmetry", asymmetry=1.2)
    assert lines.p_value.even < 1e-10
    assert lines.p_value.odd > 0.01
    assert lines.residual_nm.even > 5.0 * lines.residual_nm.odd


def test_quadratic_drag_is_odd():
    lines = knee("quadratic_drag", drag=1.8)
    assert lines.p_value.odd < 1e-3 < lines.p_value.even


def test_backlash_distorts():
    lines = knee("backlash", play=0.03, contact_stiffness=20000.0)
    assert lines.p_value.odd < 1e-10


def test_a_missing_inertia_is_linear_and_distorts_nothing():
    lines = knee("rotor_inertia", inertia=0.3)
    assert lines.p_value.excited < 1e-10
    assert min(lines.p_value.odd, lines.p_value.even) > 0.01


@pytest.mark.parametrize(
    "changed", [{"period_s": None}, {"metadata": {}}, {"period_s": 30.0}], ids=str
)
def test_a_motion_without_lines_or_two_periods_shows_nothing(changed):
    motion = session()[0]
    if "metadata" in changed:
        about = {k: v for k, v in motion.metadata.items() if k != "excited_lines"}
        changed = {"metadata": about}
    run = observe(replace(motion, **changed))
    assert detection_lines([run], [run.measured], None) == [None, None]


def test_a_verdict_has_the_lines_of_each_joint_and_others_lack_the_key(capsys):
    diagnosis = diagnose(session("viscous_asymmetry", asymmetry=1.2))
    document = verdict(diagnosis)
    checked = Verdict.model_validate(document)
    assert list(checked.detection_lines) == ["hip", "knee"]
    lines = checked.detection_lines["knee"]
    assert (lines.runs, lines.periods) == (4, 8)
    assert lines.p_value.even < 1e-10
    if diagnosis.causes:
        assert lines.extended_p_value.even > lines.p_value.even
        assert lines.extended_residual_nm.even < 0.5 * lines.residual_nm.even
    table = rows(checked)
    assert all(len(row) == len(HEADINGS) for row in table)
    assert any(row[0] == "knee, p-value" for row in table)
    console.reset()
    show_verdict(checked, HIP_AND_KNEE)
    shown = " ".join(capsys.readouterr().out.split())
    assert "what repeats at the lines of the motion" in shown
    assert "no further evidence" in shown
    assert decision(checked)["lines"]["rows"] == table
    drawn = drawing.figure(diagnosis, checked)
    assert len(drawn.axes) == 2
    assert "even" in drawn.axes[1].get_title(loc="left")
    plt.close(drawn)
    # Without the key of the recordings, all else is as before.
    plain = [
        replace(m, metadata={k: v for k, v in m.metadata.items() if k != "excited_lines"})
        for m in session("viscous_asymmetry", asymmetry=1.2)
    ]
    without = verdict(diagnose(plain))
    show_verdict(Verdict.model_validate(without), HIP_AND_KNEE)
    assert "what repeats at the lines" not in capsys.readouterr().out
    assert decision(Verdict.model_validate(without))["lines"] is None
    assert without == {key: value for key, value in document.items() if key != "detection_lines"}

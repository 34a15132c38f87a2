"""The error budget adds up, and the figures of a diagnosis show what the verdict says."""

import re
from dataclasses import replace

import numpy as np
import pytest
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from pipelines.contracts.verdict import Verdict
from pipelines.diagnosis.diagnose import diagnose
from pipelines.diagnosis.evidence.observed_run import observe
from pipelines.diagnosis.fit.fitted_model import model_of_run
from pipelines.diagnosis.verdict import worst_stretch
from pipelines.diagnosis.verdict.error_budget import scatter_between_periods, shares_of_causes
from pipelines.diagnosis.verdict.figures import FIGURES, drawing
from pipelines.diagnosis.verdict.figures.against import against
from pipelines.diagnosis.verdict.verdict import verdict
from pipelines.dynamics.replay import replay
from pipelines.errors import InputError
from pipelines.signals.binned_mean import binned_mean
from tests.diagnosis import sessions
from tests.diagnosis.naming import naming
from tests.diagnosis.sessions import session

pytestmark = pytest.mark.long


def humming(motion):
    """Add a hum at the knee that comes 54 degrees later in each period, of a phase of its own: in
    no catalogue."""
    extra = np.zeros_like(motion.torque)
    extra[:, 1] = 1.2 * np.sin(
        2 * np.pi * 7.615 * motion.time + len(motion.file + motion.run + motion.purpose)
    )
    return replace(motion, torque=motion.torque + extra)


SPRING = dict(effect="parallel_spring", joint="knee", seed=4, stiffness=6.0, rest_angle=-0.5)
DIAGNOSES = {
    "explained": lambda: sessions.diagnosed(**SPRING),
    "one kind, no periods": lambda: diagnose(
        [replace(m, period_s=None) for m in session(**SPRING) if m.run == "exo_alone"]
    ),
    "unknown": lambda: diagnose(
        [humming(m) for m in session(seed=7, seconds=40.0) if m.run == "exo_alone"]
    ),
    "spoilt": lambda: diagnose(
        [replace(m, torque=m.torque * [1.0, -1.0]) for m in session(seed=8)]
    ),
    "nothing": lambda: sessions.diagnosed(seconds=40.0),
}
NAMED = dict.fromkeys(("explained", "one kind, no periods"), "parallel_spring@knee")
"""What is named in some of them, whatever may be tied with it."""


@pytest.fixture(scope="module")
def diagnosed():
    """Return a diagnosis by its name in ``DIAGNOSES``, and its verdict, each computed once."""
    results = {}

    def of(name):
        if name not in results:
            diagnosis = DIAGNOSES[name]()
            diagnosis = naming(diagnosis, NAMED[name]) if name in NAMED else diagnosis
            results[name] = diagnosis, Verdict.model_validate(verdict(diagnosis))
        return results[name]

    return of


@pytest.fixture(autouse=True)
def no_figure_stays():
    yield
    plt.close("all")


@pytest.mark.parametrize("name", DIAGNOSES)
def test_the_shares_of_the_error_add_up_to_the_baselines_mean_square(diagnosed, name):
    _, outcome = diagnosed(name)
    for joint, shares in outcome.error_budget.items():
        assert sum(shares.values()) == pytest.approx(outcome.baseline_rmse_nm[joint] ** 2, rel=1e-9)
        assert all(share >= 0 for key, share in shares.items() if "@" not in key)


def test_a_spring_takes_the_error_at_its_joint_down_to_the_floor(diagnosed):
    diagnosis, outcome = diagnosed("explained")
    assert diagnosis.causes == ("parallel_spring@knee",)
    knee = outcome.error_budget["knee"]
    assert list(knee) == [
        "noise_floor",
        "parallel_spring@knee",
        "repeatable_unexplained",
        "not_repeatable",
    ]
    assert knee["parallel_spring@knee"] > 0.9 * outcome.baseline_rmse_nm["knee"] ** 2
    assert knee["repeatable_unexplained"] < 0.1 * knee["noise_floor"]


def test_a_hum_between_the_harmonics_does_not_repeat(diagnosed):
    _, outcome = diagnosed("unknown")
    assert outcome.status == "unknown_cause"
    knee = outcome.error_budget["knee"]
    assert knee["not_repeatable"] > 3 * knee["repeatable_unexplained"]
    assert "tone of 7.6" in drawing.DRAWN_BY["verdict"](*diagnosed("unknown")).axes[1].get_xlabel()


def test_without_periods_no_share_claims_to_repeat(diagnosed):
    knee = diagnosed("one kind, no periods")[1].error_budget["knee"]
    assert list(knee) == ["noise_floor", "parallel_spring@knee", "unexplained"]


def test_what_repeats_is_no_scatter_and_what_wanders_is():
    run = observe(session(seconds=40.0)[1])
    rng = np.random.default_rng(0)
    noise = 0.3 * rng.normal(size=(len(run.time), 4))
    repeats = 2.0 * np.sin(2 * np.pi * 3 * run.time / run.motion.period_s)[:, np.newaxis]
    np.testing.assert_allclose(scatter_between_periods([run], [noise + repeats]), 0.3**2, rtol=0.1)
    steps = 0.5 * (-1.0) ** np.floor(run.time / run.motion.period_s)[:, np.newaxis]
    # Four periods of +0.5, -0.5, ...: variance 0.25 x 4 / 3.
    np.testing.assert_allclose(
        scatter_between_periods([run], [noise + steps]), 0.3**2 + 0.25 * 4 / 3, rtol=0.1
    )


def test_two_causes_that_overlap_share_what_either_would_take():
    # Alone a takes 6 and b takes 5 of 10; together 8.
    remaining = {(): 10.0, ("a",): 4.0, ("b",): 5.0, ("a", "b"): 2.0}
    shares = shares_of_causes(
        ("a", "b"), lambda labels: np.array([remaining[tuple(sorted(labels))]])
    )
    np.testing.assert_allclose([shares["a"], shares["b"]], [[4.5], [3.5]])


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=() if name in ("explained", "spoilt") else pytest.mark.slow)
        for name in DIAGNOSES
    ],
)
def test_every_figure_is_drawn_whatever_the_verdict(diagnosed, name, tmp_path):
    drawing.draw(*diagnosed(name), tmp_path)
    written = {path.name: path.read_bytes()[:4] for path in tmp_path.iterdir()}
    assert written == {f"{stem}.png": b"\x89PNG" for stem in FIGURES} | {
        f"{stem}.pdf": b"%PDF" for stem in ("decision", "verdict", "error-budget")
    }


@pytest.mark.parametrize("name", ["explained", "unknown", "nothing"])
def test_the_verdicts_bars_are_as_long_as_their_shares(diagnosed, name):
    diagnosis, outcome = diagnosed(name)
    bars = drawing.DRAWN_BY["verdict"](diagnosis, outcome).axes[0].patches
    drawn = [bar.get_width() for bar in bars]
    wanted = [
        100 * s / sum(shares.values())
        for shares in outcome.error_budget.values()
        for s in shares.values()
    ]
    np.testing.assert_allclose(drawn, wanted)


@pytest.mark.parametrize("name", ["explained", "one kind, no periods", "unknown", "nothing"])
def test_the_decisions_bars_are_as_long_as_the_shares_of_the_residual_and_the_probabilities_of_sets(
    diagnosed, name
):
    diagnosis, outcome = diagnosed(name)
    shares, _, sets = drawing.DRAWN_BY["decision"](diagnosis, outcome).axes
    parts = [
        getattr(outcome.router[joint], part) or 0.0
        for joint in diagnosis.baseline.joints
        for part in ("noise", "wanders", "between_runs", "unsplit", "repeats")
    ]
    # A hatched bar without a fill marks the person's part.
    drawn = [bar.get_width() for bar in shares.patches if bar.get_fill()]
    np.testing.assert_allclose(drawn, parts)
    assert sum(drawn) == pytest.approx(len(diagnosis.baseline.joints), abs=1e-9), (
        "each joint's add up to one"
    )
    likely = sorted(diagnosis.selected.posterior.by_labels.values(), reverse=True)
    bars = list(dict.fromkeys(bar.get_width() for bar in sets.patches))
    shown = sum(p >= 0.01 for p in likely[:6])
    np.testing.assert_allclose(bars[:shown], likely[:shown])
    np.testing.assert_allclose(
        bars[shown:], [1.0 - sum(likely[:shown])] * (len(bars) > shown), atol=1e-9
    )


def test_no_set_is_weighed_where_acquisition_is_at_fault(diagnosed):
    *_, sets = drawing.DRAWN_BY["decision"](*diagnosed("spoilt")).axes
    assert [text.get_text() for text in sets.texts] == ["not searched: acquisition is at fault"]


def test_a_spring_is_shown_against_its_joints_angle(diagnosed):
    shape = drawing.DRAWN_BY["verdict"](*diagnosed("explained")).axes[1]
    assert shape.get_xlabel() == "knee angle, rad"
    assert shape.get_ylabel() == "knee torque error, N·m"


def test_what_the_residual_goes_with_most_is_drawn_first(diagnosed):
    diagnosis, outcome = diagnosed("explained")
    ranking = outcome.depends_on["knee"]
    drawn = drawing.DRAWN_BY["dependence"](diagnosis, outcome)
    first = next(axis for axis in drawn.axes if axis.get_ylabel() == "knee residual, N·m")
    assert first.get_xlabel().startswith(f"knee {ranking[0].variable}, ")
    assert first.get_title() == f"{ranking[0].share_before:.0%} → {ranking[0].share_after:.0%}"


def test_a_named_cause_leaves_nothing_that_goes_with_its_variable(diagnosed):
    ranking = {one.variable: one for one in diagnosed("explained")[1].depends_on["knee"]}
    assert ranking["angle"].share_before > 0.5
    assert ranking["angle"].share_after < 0.1


def test_a_tone_is_folded_onto_its_crest(diagnosed):
    diagnosis, _ = diagnosed("nothing")
    humming = [
        e + 2.0 * np.cos(2 * np.pi * 3.137 * run.time + phase)[:, np.newaxis]
        for phase, (run, e) in enumerate(
            zip(diagnosis.validate, diagnosis.before.residuals, strict=True)
        )
    ]
    seen = against(
        "tone",
        replace(diagnosis, before=replace(diagnosis.before, residuals=humming)),
        "knee",
        ("with_human",),
    )
    frequency = re.search(r"tone of ([\d.]+) Hz", seen.label)
    assert float(frequency[1]) == pytest.approx(3.137, abs=0.02)
    x, mean = binned_mean(seen.x, seen.before, seen.x.min(), seen.x.max())
    np.testing.assert_allclose(mean, 2.0 * np.cos(2 * np.pi * x), atol=0.35)


def test_the_figures_models_stray_as_far_as_the_verdict_says(diagnosed):
    diagnosis, _ = diagnosed("explained")
    fit = diagnosis.after.fit
    errors = [
        replay(model_of_run(fit, diagnosis.baseline, run), run.motion, 1.0, 1.0).error
        for run in diagnosis.validate
    ]
    pooled = np.concatenate([error.reshape(-1, 2) for error in errors])
    np.testing.assert_allclose(
        np.sqrt(np.mean(pooled**2, axis=0)), diagnosis.simulation_error["extended"], rtol=1e-6
    )


def test_a_model_that_no_leg_has_is_said_not_to_be_simulated(diagnosed, monkeypatch):
    def impossible(model, motion, every_s):
        raise InputError("no such leg")

    diagnosis, outcome = diagnosed("explained")
    monkeypatch.setattr(worst_stretch, "replay", impossible)
    nowhere = dict.fromkeys(diagnosis.baseline.joints)
    drawn = drawing.DRAWN_BY["simulation"](
        diagnosis, outcome.model_copy(update={"baseline_simulation_rmse_rad": nowhere})
    )
    words = [text.get_text() for text in drawn.legends[0].get_texts()]
    assert "rigid body and friction (cannot be simulated)" in words


def test_a_figure_that_fails_leaves_no_half_of_it(diagnosed, tmp_path, monkeypatch):
    def full(figure, path, **kwargs):
        path.write_bytes(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Figure, "savefig", full)
    with pytest.raises(OSError, match="No space left"):
        drawing.draw(*diagnosed("nothing"), tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_every_figure_that_is_named_is_drawn():
    assert tuple(drawing.DRAWN_BY) == FIGURES

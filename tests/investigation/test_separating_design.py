"""Excitations that decide between causes: what they predict, what they gain, what they refuse."""

import json
from dataclasses import replace

import numpy as np
import pytest

from pipelines.contracts.verdict import read
from pipelines.design.excitation import design
from pipelines.errors import InputError, NotIdentifiable
from pipelines.investigation.planned import PlannedRuns
from pipelines.investigation.rivals import (
    Appearance,
    Rival,
    SizedRival,
    rivals_in_verdict,
    rivals_named,
    sized,
)
from pipelines.investigation.separating_design import (
    separating_design,
    separation,
    separation_of_last,
)
from pipelines.investigation.separation import DECIDED
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.limits import margins
from pipelines.mechanics.machine import THE_LEG
from pipelines.model import Term
from pipelines.settings.design import DesignSettings
from pipelines.settings.rig.plant import PlantSettings
from tests.report.sessions import AXIS, decision_of, write_verdict

QUICK = DesignSettings(harmonics=3, particles=24, iterations=50)
RUNS = PlannedRuns(QUICK, PlantSettings())
EASY = ("parallel_spring@knee", "rotor_inertia@knee")
HARD = ("mass_off_axis@hip", "torque_offset@hip")
"""Causes that the usual excitation hardly separates."""


@pytest.fixture(scope="module")
def usual():
    return design(QUICK).trajectory


def named(*labels):
    return rivals_named(labels, THE_LEG)


def of_size(trajectory, share, *labels):
    """Return rivals of a share of their usual torque."""
    rivals = sized(named(*labels), RUNS.problem(trajectory, [one.effect for one in named(*labels)]))
    return [
        SizedRival(one.rival, tuple((c, share * a) for c, a in one.truths), one.shapes)
        for one in rivals
    ]


def test_the_expected_log_odds_are_the_mean_of_simulated_log_likelihoods(usual):
    # Small torques, as the error of the model's form counts with large ones.
    found = separation(of_size(usual, 0.03, *EASY), RUNS, usual)
    (true,), ((spring,), (inertia,)) = found.truths[0], found.shapes
    rng = np.random.default_rng(1)
    rows = true.torque + rng.standard_normal((5000, len(true.torque)))

    def log_likelihood(span):
        # Each amplitude fits half a unit of noise, and costs its price.
        width = span.shape[1]
        return 0.5 * (np.sum((rows @ span) ** 2, axis=1) - width) - found.price * width

    odds = log_likelihood(spring.span) - log_likelihood(inertia.span)
    error = float(np.std(odds)) / np.sqrt(len(odds))
    assert 2.0 < true.torque @ true.torque < 20.0
    assert found.log_odds()[0, 1] == pytest.approx(np.mean(odds), abs=4.0 * error + 0.05)


@pytest.mark.parametrize("share", [0.1, 0.2, 1.0])
def test_a_simulated_decision_is_seldom_wrong(usual, share):
    labels = (*EASY, "torque_gain@knee")
    posterior = separation(of_size(usual, share, *labels), RUNS, usual).posterior(draws=2000)
    assert posterior.sum(axis=-1) == pytest.approx(np.ones(posterior.shape[:2]))
    truth = np.arange(len(labels))[:, np.newaxis]
    decided = posterior.max(axis=-1) >= DECIDED
    wrong = decided & (posterior.argmax(axis=-1) != truth)
    assert wrong.sum() <= (1.0 - DECIDED) * decided.sum()


def test_a_design_decides_what_the_usual_excitation_leaves_open(usual):
    result = separating_design(separation_of_last(named(*HARD), RUNS, usual), RUNS, Geometry())
    assert result.separation.least() > 2.0 * result.before.least()
    decided = [np.mean(one.as_json()["decided"]) for one in (result.before, result.separation)]
    assert decided[1] > decided[0] + 0.25
    # As any excitation, it keeps its bounds at every time, and is found again.
    assert all(margin.kept for margin in margins(result.design.trajectory, QUICK.bounds))
    again = separating_design(
        separation_of_last(named(*HARD), RUNS, usual), RUNS, Geometry()
    ).design.trajectory
    assert np.array_equal(again.a, result.design.trajectory.a)


@pytest.mark.slow
def test_where_a_motion_surely_decides_the_parameters_count(usual):
    quick = replace(RUNS, settings=QUICK.changed(particles=12))
    result = separating_design(separation_of_last(named(*EASY), quick, usual), quick, Geometry())
    assert result.separation.least() > 20.0
    assert result.design.quality.log_det > design(QUICK).quality.log_det - 4.0


@pytest.mark.parametrize(
    "pair",
    [("torque_gain@hip", "torque_gain@knee"), ("coulomb_asymmetry@knee", "torque_offset@knee")],
)
def test_causes_that_no_motion_separates_are_refused(pair, usual):
    with pytest.raises(NotIdentifiable, match=f"no motion .* separates {pair[0]} and {pair[1]}"):
        separating_design(separation_of_last(named(*pair), RUNS, usual), RUNS, Geometry())


@pytest.mark.parametrize(
    ("labels", "message"),
    [
        ([], "found no cause, expected two different causes"),
        (["base_tilt"], "found base_tilt, expected two different causes"),
        (["base_tilt", "base_tilt"], "found base_tilt, base_tilt, expected two different"),
        (["base_tilt", "friction@knee"], "found friction@knee"),
        (["base_tilt", "nonsense"], "there is no effect 'nonsense'"),
        (["base_tilt", "cogging@elbow"], "expected cogging@hip or cogging@knee"),
    ],
)
def test_labels_that_are_no_rivals_are_refused(labels, message):
    with pytest.raises(InputError, match=message) as caught:
        named(*labels)
    assert str(caught.value).startswith("--separate")


def test_causes_that_planned_runs_cannot_show_are_refused(usual):
    with pytest.raises(InputError, match="friction_temperature@hip cannot show in planned runs"):
        of_size(usual, 1.0, "base_tilt", "friction_temperature@hip")


def test_a_cause_without_torque_in_the_last_excitation_is_refused(usual):
    # The knee rests, so that nothing of its speed shows.
    a, b = usual.a.copy(), usual.b.copy()
    a[1] = b[1] = 0.0
    resting = replace(usual, a=a, b=b)
    with pytest.raises(InputError, match="quadratic_drag@knee makes no torque with the last"):
        of_size(resting, 1.0, "base_tilt", "quadratic_drag@knee")


def test_a_tie_of_a_fitted_cause_makes_its_torque(usual):
    spring, inertia = named(*EASY)
    fitted = Rival(spring.effect, 0.6, Term(spring.effect, np.array([7.0, 0.0])))
    problem = RUNS.problem(usual, [fitted.effect, inertia.effect])
    truths = [one.truths[0] for one in sized([fitted, inertia], problem)]
    lengths = [a * np.linalg.norm(Appearance.of(one, problem).torque) for one, a in truths]
    assert lengths[1] == pytest.approx(lengths[0])
    assert truths[0][1] >= 7.0, "its preload was no torque that the baseline leaves"


def test_a_verdict_s_ties_are_rivals_with_its_probabilities_and_noise(tmp_path):
    write_verdict(tmp_path, **decision_of())
    folder = tmp_path / "diagnosed"
    document = json.loads((folder / "verdict.json").read_text())
    amplitude = {"value": 1.5, "unit": "N·m", "ci95": [1.0, 2.0]}
    document["causes"][0]["parameters"] = [
        {**amplitude, "name": "amplitude"},
        {**amplitude, "name": "cycles_per_turn", "value": 9.0, "unit": "1/turn"},
        {**amplitude, "name": "phase", "value": 0.4, "unit": "rad"},
    ]
    (folder / "verdict.json").write_text(json.dumps(document))
    found = read(folder / "verdict.json")
    rivals = rivals_in_verdict(folder, THE_LEG)
    assert {one.label: one.probability for one in rivals} == pytest.approx(
        {"cogging@knee": 2.0 / 3.0, "parallel_spring@knee": 1.0 / 3.0}
    )
    # The verdict gives an amplitude and a phase, the fit has a sine and a cosine.
    assert np.linalg.norm(rivals[0].term.linear) == pytest.approx(1.5)
    assert rivals[0].term.shape == pytest.approx([9.0])
    assert rivals[1].term is None
    planned = RUNS.as_in_verdict(folder)
    assert planned.noise_nm == (found.noise_floor_nm["hip"], found.noise_floor_nm["knee"])
    assert planned.kinds == tuple(found.runs)


def test_a_verdict_without_a_choice_or_of_another_machine_is_refused(tmp_path):
    write_verdict(tmp_path, **decision_of(ties=()))
    with pytest.raises(InputError, match="leaves no choice of causes"):
        rivals_in_verdict(tmp_path / "diagnosed", THE_LEG)
    write_verdict(tmp_path, AXIS, **decision_of(AXIS))
    with pytest.raises(InputError, match="expected hip and knee"):
        RUNS.as_in_verdict(tmp_path / "diagnosed")

"""Excitations that decide between causes: what they predict, what they gain, what they refuse."""

import json
from dataclasses import replace

import numpy as np
import pytest

from pipelines.contracts.verdict import read
from pipelines.design.excitation import design
from pipelines.errors import InputError, NotIdentifiable
from pipelines.investigation.doubt import DECIDED
from pipelines.investigation.planned import PlannedRuns
from pipelines.investigation.rivals import Rival, rivals_in_verdict, rivals_named
from pipelines.investigation.separating_design import separating_design
from pipelines.investigation.separation_problem import SeparationProblem
from pipelines.investigation.sized_rival import Truth, sized
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.limits import margins
from pipelines.mechanics.machine import THE_LEG
from pipelines.model import Term
from pipelines.settings.design import DesignSettings
from pipelines.settings.rig.plant import PlantSettings
from tests.report.sessions import AXIS, decision_of, write_verdict

QUICK = DesignSettings(harmonics=3, particles=24, iterations=50, seconds=15.0)
RUNS = PlannedRuns(QUICK, PlantSettings())
EASY = ("parallel_spring@knee", "rotor_inertia@knee")
HARD = ("mass_off_axis@hip", "torque_offset@hip")
"""Causes that the usual excitation hardly separates."""


@pytest.fixture(scope="module")
def usual():
    return design(QUICK).trajectory


def named(*labels):
    return rivals_named(labels, THE_LEG)


def question(motion, *labels, runs=RUNS):
    return SeparationProblem.of(named(*labels), runs, motion)


def of_size(motion, share, *labels):
    """Return how well a motion separates rivals of a share of their usual torque."""
    problem = question(motion, *labels)
    rivals = [
        replace(one, truths=tuple(replace(t, factor=share * t.factor) for t in one.truths))
        for one in problem.rivals
    ]
    return replace(problem, rivals=tuple(rivals)).with_motion(motion)


def test_the_expected_log_odds_are_the_mean_of_simulated_log_likelihoods(usual):
    # Small torques, as the error of the model's form counts with large ones.
    found = of_size(usual, 0.1, *EASY)
    (true,), ((spring,), (inertia,)) = found.truths[0], found.shapes
    rng = np.random.default_rng(1)
    rows = true + rng.standard_normal((5000, len(true)))

    # Each amplitude fits half a unit of noise.
    noise = [0.5 * (one.sizes**2 / (1.0 + one.sizes**2)).sum() for one in (spring, inertia)]
    odds = spring.log_likelihood(rows) - inertia.log_likelihood(rows) - noise[0] + noise[1]
    error = float(np.std(odds)) / np.sqrt(len(odds))
    assert 2.0 < true @ true < 20.0
    assert found.log_odds()[0, 1] == pytest.approx(np.mean(odds), abs=4.0 * error + 0.05)


@pytest.mark.parametrize("share", [0.2, 0.4, 1.0])
def test_a_simulated_decision_is_seldom_wrong(usual, share):
    labels = (*EASY, "torque_gain@knee")
    posterior = of_size(usual, share, *labels).posterior(draws=2000)
    assert posterior.sum(axis=-1) == pytest.approx(np.ones(posterior.shape[:2]))
    truth = np.arange(len(labels))[:, np.newaxis]
    decided = posterior.max(axis=-1) >= DECIDED
    wrong = decided & (posterior.argmax(axis=-1) != truth)
    assert wrong.sum() <= (1.0 - DECIDED) * decided.sum()


def test_a_design_decides_what_the_usual_excitation_leaves_open(usual):
    result = separating_design(question(usual, *HARD), Geometry(), usual)
    assert result.separation.log_loss() < 0.5 * result.before.log_loss()
    decided = [np.mean(one.as_json()["decided"]) for one in (result.before, result.separation)]
    assert decided[1] > decided[0] + 0.25
    # As any excitation, it keeps its bounds at every time.
    assert all(margin.kept for margin in margins(result.design.trajectory, QUICK.bounds))


def test_equal_settings_give_an_equal_excitation(usual):
    # Not seconds: a busy machine would end the two searches at different motions.
    settings = QUICK.changed(harmonics=1, particles=4, seconds=600.0)
    quick = replace(RUNS, settings=settings, kinds=("exo_alone",))
    one, again = (
        separating_design(question(usual, *HARD, runs=quick), Geometry(), usual).design.trajectory
        for _ in range(2)
    )
    assert np.array_equal(one.a, again.a) and np.array_equal(one.theta0, again.theta0)


@pytest.mark.slow
def test_where_a_motion_surely_decides_the_parameters_count(usual):
    quick = replace(RUNS, settings=QUICK.changed(particles=12))
    result = separating_design(question(usual, *EASY, runs=quick), Geometry(), usual)
    assert result.separation.log_loss() < 0.01
    assert result.design.quality.log_det > design(QUICK).quality.log_det - 4.0


def test_the_log_loss_is_that_of_simulated_experiments(usual):
    # Between decided and undecided. Of two rivals with one amplitude each the bound is exact.
    for share in (0.05, 0.1, 0.15):
        found = of_size(usual, share, "viscous_asymmetry@knee", "rotor_inertia@knee")
        posterior = found.posterior(draws=4000)
        truth = np.diagonal(posterior, axis1=0, axis2=2)
        simulated = -np.log(truth).mean()
        assert found.log_loss() == pytest.approx(simulated, abs=0.05 + 0.2 * simulated), share


def test_a_motion_that_shows_no_rival_decides_nothing(usual):
    # Both stops are beyond what this motion reaches.
    still = replace(usual, a=0.02 * usual.a, b=0.02 * usual.b)
    found = question(usual, "end_stop@hip", "end_stop@knee").with_motion(still)
    assert found.log_loss() == pytest.approx(np.log(2.0), rel=0.1)
    assert found.decides() == 0.0
    assert not found.separable().any()


@pytest.mark.parametrize(
    "pair",
    [("torque_gain@hip", "torque_gain@knee"), ("coulomb_asymmetry@knee", "torque_offset@knee")],
)
def test_causes_that_no_motion_separates_are_refused(pair, usual):
    with pytest.raises(NotIdentifiable, match=f"no motion .* separates {pair[0]} and {pair[1]}"):
        separating_design(question(usual, *pair), Geometry(), usual)


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


def mean_of(truths, problem):
    return np.mean([one.torque(problem) for one in truths], axis=0)


@pytest.mark.filterwarnings("error")
def test_a_motion_at_rest_leaves_the_probabilities_as_they_are(usual):
    resting = replace(usual, a=0.0 * usual.a, b=0.0 * usual.b)
    separated = question(usual, *EASY).with_motion(resting)
    assert separated.posterior() == pytest.approx(np.full((2, 400, 2), 0.5))
    assert separated.log_loss() == pytest.approx(np.log(2.0))


def test_a_tie_of_a_fitted_cause_makes_its_torque(usual):
    asymmetry, offset = named("coulomb_asymmetry@hip", "torque_offset@hip")
    fitted = Rival(asymmetry.effect, 0.6, Term(asymmetry.effect, np.array([-2.0])))
    problem = RUNS.problem(usual, [fitted.effect, offset.effect])
    own, other = (one.truths for one in sized([fitted, offset], problem, QUICK.bounds))
    assert np.mean([one.linear for one in own]) == pytest.approx(-2.0, rel=0.05)
    assert mean_of(other, problem) == pytest.approx(mean_of(own, problem), rel=0.01, abs=0.01)


def test_a_tie_may_be_a_part_of_the_fitted_cause(usual):
    # The preload of a spring is the torque offset that the runs may have shown as well.
    spring, offset = named("parallel_spring@knee", "torque_offset@knee")
    fitted = Rival(spring.effect, 0.6, Term(spring.effect, np.array([0.0, 3.0])))
    problem = RUNS.problem(usual, [fitted.effect, offset.effect])
    _, other = (one.truths for one in sized([fitted, offset], problem, QUICK.bounds))
    assert abs(np.mean([one.linear for one in other])) == pytest.approx(3.0, rel=0.05)


def test_an_amplitude_is_as_well_known_as_the_runs_show_it(usual):
    spring = named(*EASY)[0]
    problem = RUNS.problem(usual, [spring.effect])
    fitted = Rival(spring.effect, 1.0, Term(spring.effect, np.array([7.0, 2.0])))
    truths = sized([fitted], problem, QUICK.bounds)[0].truths
    linear = np.array([one.linear for one in truths])
    units = [Truth(truths[0].candidate, 1.0, one).torque(problem) for one in np.eye(2)]
    known = np.linalg.inv(np.array(units) @ np.transpose(units) + np.diag([20.0**-2, 15.0**-2]))
    assert np.cov(linear.T, bias=True) == pytest.approx(known, rel=1e-6)


def test_what_is_hardly_seen_is_small(usual):
    spring = named(*EASY)[0]
    large = Term(spring.effect, np.array([20.0, 0.0]))

    def length(nothing):
        rivals = [Rival(spring.effect, 1.0 - nothing, large), Rival(None, nothing)]
        problem = RUNS.problem(usual, [spring.effect])
        return float(
            np.linalg.norm(sized(rivals, problem, QUICK.bounds)[0].truths[0].torque(problem))
        )

    assert length(0.8) < length(0.5) < length(0.1) < length(1e-9)


def test_after_a_diagnosis_the_same_motion_again_tells_a_cause_from_noise(usual):
    odds, posterior = repeated(usual, noise_nm=(2.0, 2.0))
    # The torque that was seen is seen again, or it was noise: nothing gains where it is not.
    assert odds[0, 1] > 2.0 and odds[1, 0] > 1.0
    assert np.all(np.diagonal(posterior) > 0.7)


def test_the_same_motion_again_does_not_tell_a_cause_from_the_background_of_a_good_rig(usual):
    # With little noise, what is hardly seen is a little of many causes, and is seen again.
    odds, posterior = repeated(usual, noise_nm=(0.02, 0.02))
    assert odds.max() < 1.5
    assert np.diagonal(posterior).mean() < 0.6


def repeated(motion, noise_nm):
    """Return what a repeated motion tells of a spring that was hardly seen, or nothing."""
    spring = named(*EASY)[0]
    rivals = [Rival(spring.effect, 0.5), Rival(None, 0.5)]
    runs = replace(RUNS, noise_nm=noise_nm).after([motion])
    again = SeparationProblem.of(rivals, runs, motion).with_motion(motion)
    return again.log_odds(), again.posterior().mean(axis=1)


def test_expected_posteriors_are_calibrated(usual):
    spring, inertia = (one.effect for one in named(*EASY))
    fitted = Term(spring, np.array([1.5, 0.0]))
    rivals = [Rival(spring, 0.5, fitted), Rival(inertia, 0.3), Rival(None, 0.2)]
    problem = SeparationProblem.of(rivals, RUNS.after([usual]), usual)
    posterior = problem.with_motion(usual).posterior(draws=4000)
    # Of experiments drawn with these probabilities, those that say p are right in p of all cases.
    said = posterior.transpose(2, 0, 1).reshape(3, -1)
    right = np.repeat(np.eye(3), posterior.shape[1], axis=1)
    weight = np.repeat([0.5, 0.3, 0.2], posterior.shape[1])
    for low, high in ((0.0, 0.1), (0.1, 0.5), (0.5, 0.9), (0.9, 1.01)):
        here = (low <= said) & (said < high)
        weights = np.broadcast_to(weight, said.shape)[here]
        assert weights.sum() > 100.0
        share, mean = (
            np.average(right[here], weights=weights),
            np.average(said[here], weights=weights),
        )
        assert share == pytest.approx(mean, abs=0.1), (low, high)


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
    rivals = rivals_in_verdict(found, folder / "verdict.json", THE_LEG)
    assert {one.label: one.probability for one in rivals} == pytest.approx(
        {"cogging@knee": 0.95 * 2.0 / 3.0, "parallel_spring@knee": 0.95 / 3.0}
    )
    # The verdict gives an amplitude and a phase, the fit has a sine and a cosine.
    assert np.linalg.norm(rivals[0].term.linear) == pytest.approx(1.5)
    assert rivals[0].term.shape == pytest.approx([9.0])
    assert rivals[1].term is None
    planned = RUNS.as_in_verdict(found, folder / "verdict.json")
    assert planned.noise_nm == (found.noise_floor_nm["hip"], found.noise_floor_nm["knee"])
    assert planned.kinds == tuple(found.runs)


@pytest.mark.parametrize(
    "law",
    [
        "law:angle@elbow",
        "law:nonsense@hip",
        "law:angle",
        "law:across_joints@hip",
        "law:angle@hip/x",
    ],
)
def test_a_law_that_the_machine_cannot_have_is_refused(tmp_path, law):
    write_verdict(tmp_path, **decision_of(ties=()))
    file = tmp_path / "diagnosed" / "verdict.json"
    document = json.loads(file.read_text())
    document["posterior"]["laws"][law] = 0.06
    file.write_text(json.dumps(document))
    with pytest.raises(InputError, match=rf"laws: found {law}, expected a law of hip or knee"):
        rivals_in_verdict(read(file), file, THE_LEG)


def test_rivals_that_may_be_there_together_are_at_most_certain(tmp_path):
    write_verdict(tmp_path, **decision_of())
    file = tmp_path / "diagnosed" / "verdict.json"
    document = json.loads(file.read_text())
    for cause in document["findings"][0]["causes"]:
        cause["probability"] = 0.75
    document["causes"] = []
    file.write_text(json.dumps(document))
    rivals = rivals_in_verdict(read(file), file, THE_LEG)
    assert [one.probability for one in rivals] == pytest.approx([0.5, 0.5])


def test_a_verdict_without_a_choice_or_of_another_machine_is_refused(tmp_path):
    write_verdict(tmp_path, **decision_of(ties=()))
    file = tmp_path / "diagnosed" / "verdict.json"
    with pytest.raises(InputError, match="leaves no choice of causes"):
        rivals_in_verdict(read(file), file, THE_LEG)
    write_verdict(tmp_path, AXIS, **decision_of(AXIS))
    with pytest.raises(InputError, match="expected hip and knee"):
        RUNS.as_in_verdict(read(file), file)


def test_what_a_good_rig_has_is_of_the_same_size_along_every_motion(usual):
    # Half of the speed makes half of the torque.
    (asymmetry,) = (one.effect for one in named("viscous_asymmetry@knee", EASY[0])[:1])
    slow = replace(usual, a=0.5 * usual.a, b=0.5 * usual.b)
    runs = question(usual, *EASY).runs
    traces = [one for one in runs.background if one.candidate.effect.label == asymmetry.label]
    alone = replace(runs, background=tuple(traces))
    sizes = [np.linalg.norm(alone.problem(one, []).background) for one in (usual, slow)]
    # A share of each motion's own torque would be as large.
    assert sizes[1] < 0.6 * sizes[0]


def test_weighted_rows_have_a_weighted_background(usual):
    problem = question(usual, *EASY).runs.problem(usual, [])
    halved = problem.weighted(np.full(4, 0.25))
    assert halved.background == pytest.approx(0.5 * problem.background, abs=1e-9)


def test_the_background_of_diagnosed_runs_is_the_same_whether_it_was_computed_before(usual):
    runs = SeparationProblem.of(named(*EASY), RUNS.after([usual]), usual).runs
    motion = replace(usual, a=usual.b, b=usual.a)
    effects = [one.effect for one in named(*EASY)]
    unknown = tuple(trace._replace(known=()) for trace in runs.background)
    anew = replace(runs, background=unknown).problem(motion, effects).background
    assert runs.problem(motion, effects).background == pytest.approx(anew, abs=1e-4 * anew.max())

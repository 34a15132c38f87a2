from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.signal import lfilter

from pipelines.errors import InputError, NotIdentifiable
from pipelines.identification import identify

RATE_HZ = 200.0


def white(shape, rng):
    return rng.standard_normal(shape)


def first_order(correlation_s):
    """Noise that resembles itself over a time."""

    def make(shape, rng):
        rho = np.exp(-1 / (RATE_HZ * correlation_s))
        start = int(10 * correlation_s * RATE_HZ)
        noise = lfilter(
            [np.sqrt(1 - rho**2)],
            [1, -rho],
            rng.standard_normal((shape[0] + start, *shape[1:])),
            axis=0,
        )
        return noise[start:]

    return make


def resonant(shape, rng):
    """Ripple about 3 Hz, a tenth of that wide."""
    radius, angle = np.exp(-np.pi * 0.3 / RATE_HZ), 2 * np.pi * 3.0 / RATE_HZ
    noise = lfilter(
        [1.0], [1, -2 * radius * np.cos(angle), radius**2], rng.standard_normal(shape), axis=0
    )
    return noise / noise.std(axis=0)


COLOURS = {"white": white, "20 ms": first_order(0.02), "0.2 s": first_order(0.2), "3 Hz": resonant}


def with_noise(motions, colour, rms, seed):
    rng = np.random.default_rng(seed)
    return [
        replace(m, torque=m.torque + COLOURS[colour](m.torque.shape, rng) * rms) for m in motions
    ]


def test_the_truth_is_recovered_without_noise(noiseless_motions, truth):
    found = identify(noiseless_motions)
    assert_allclose(found.parameters["value"], truth, rtol=0.01, atol=0.005)


@pytest.mark.slow
def test_the_truth_lies_in_the_intervals_95_times_in_100_under_coloured_noise(
    noiseless_motions, truth
):
    inside, bias = [], []
    for colour in COLOURS:
        for seed in range(50):
            table = identify(with_noise(noiseless_motions, colour, (0.6, 0.4), seed)).parameters
            inside.append((table["ci95_low"] <= truth) & (truth <= table["ci95_high"]))
            bias.append((table["value"] - truth) / table["std_error"])
    covered = np.mean(inside)
    each = np.mean(np.reshape(inside, (len(COLOURS), -1)), axis=1)
    print(f"\ncovered {covered:.3f}; {dict(zip(COLOURS, each.round(3).tolist(), strict=True))}")
    # 200 sessions of 16 parameters, strongly dependent within a session.
    assert 0.92 <= covered <= 0.98, (
        f"covered {covered:.3f}; each parameter {np.mean(inside, axis=0).round(2)}"
    )
    assert np.all(np.abs(np.mean(bias, axis=0)) < 0.4), np.mean(bias, axis=0).round(2)


def test_the_formula_for_independent_samples_covers_far_less(noiseless_motions, truth):
    """Why the sandwich is there: 0.2 s of correlation at 40 blocks a second."""
    inside = []
    for seed in range(30):
        motions = with_noise(noiseless_motions, "0.2 s", (0.6, 0.4), seed)
        inside.append(covers_as_if_independent(motions, truth[:8]))
    print(f"\ncovered as if independent {np.mean(inside):.3f}")
    assert np.mean(inside) < 0.7


def covers_as_if_independent(motions, truth):
    from pipelines.estimation.least_squares import WeightedLeastSquares
    from pipelines.estimation.problem import Problem, Training
    from pipelines.mechanics.machine import THE_LEG
    from pipelines.model import Model, baseline

    effects = baseline(THE_LEG, ("exo_alone",))
    model = Model.of(effects)
    problem = Problem(Training((motions[0],), model), ("exo_alone",), np.arange(8), np.zeros(8))
    fit = WeightedLeastSquares().fit(problem)
    return np.abs(fit.values - truth) < 1.96 * np.sqrt(np.diag(fit.sensitivity))


def test_uncertain_friction_widens_the_interval_of_inertia(noiseless_motions):
    """With friction known from a short run, inertia with the human is less sure."""
    motions = with_noise(noiseless_motions, "20 ms", (0.6, 0.4), 1)
    short = motions[0]
    valid = short.valid & (short.time < 11.0)
    poor = identify([replace(short, valid=valid), *motions[1:]]).parameters
    rich = identify(motions).parameters
    body = rich["run"] == "with_human"
    assert np.all(poor["std_error"][body] > rich["std_error"][body])
    assert np.max(poor["std_error"][body] / rich["std_error"][body]) > 1.2


def test_slow_noise_with_the_human_widens_no_interval_of_friction(noiseless_motions):
    """The human's runs alone tremble slowly: friction, fitted before, keeps the intervals of a
    session without."""
    quiet = with_noise(noiseless_motions, "white", (0.6, 0.4), 6)
    slow = with_noise(noiseless_motions, "0.2 s", (0.6, 0.4), 6)
    alone, human = ("exo_alone", "with_human")
    mixed = [s if s.run == human else q for q, s in zip(quiet, slow, strict=True)]
    before, after = identify(quiet).parameters, identify(mixed).parameters
    critical = (
        ((after["ci95_high"] - after["value"]) / after["std_error"])
        .groupby(after["run"].fillna(alone))
        .first()
    )
    assert critical[human] > critical[alone]
    assert_allclose(critical["human"], critical[human], rtol=1e-12)
    first = before["run"].isna() | (before["run"] == alone)
    assert_allclose(after["ci95_high"][first], before["ci95_high"][first], rtol=1e-12)


def test_two_steps_agree_with_one_fit_of_everything(noiseless_motions):
    found = identify(with_noise(noiseless_motions, "20 ms", (0.6, 0.4), 3))
    apart = np.abs(found.parameters["value"] - found.one_step) / found.parameters["std_error"]
    assert np.max(apart) < 3.0


def test_human_is_with_human_less_exo_alone(noiseless_motions):
    found = identify(with_noise(noiseless_motions, "white", (0.6, 0.4), 4))
    values = found.parameters.set_index(["run", "name"])["value"]
    for name in ("X1", "X2", "X3", "X4"):
        assert_allclose(
            values["human", name],
            values["with_human", name] - values["exo_alone", name],
            rtol=1e-12,
        )


def test_validation_error_of_a_faultless_machine_is_its_noise(noiseless_motions):
    noisy = with_noise(noiseless_motions, "20 ms", (0.6, 0.4), 5)
    found = identify(noisy)
    # What the block average leaves of the noise itself.
    left = [
        (m.torque - n.torque)[: len(m) // 5 * 5].reshape(-1, 5, 2).mean(axis=1)
        for m, n in zip(noisy, noiseless_motions, strict=True)
        if m.purpose == "validate"
    ]
    assert_allclose(found.validation.pooled.rmse, np.concatenate(left).std(axis=0), rtol=0.04)


def test_an_empty_machine_alone_can_be_identified(noiseless_motions, truth):
    found = identify([m for m in noiseless_motions if m.run == "exo_alone"])
    assert list(found.parameters["run"].dropna().unique()) == ["exo_alone"]
    assert_allclose(found.parameters["value"], truth[:8], rtol=0.01, atol=0.005)


def test_a_joint_that_never_moves_is_refused_with_the_reason(noiseless_motions):
    frozen = [
        replace(
            m,
            q=m.q * [1, 0] + [0, -0.9],
            dq=m.dq * [1, 0] + [0, 0.1],
            ddq=m.ddq * [1, 0],
        )
        for m in noiseless_motions
    ]
    with pytest.raises(
        NotIdentifiable,
        match=r"the motion does not separate .* any of them can stand for the others",
    ):
        identify(frozen)


def test_a_torque_that_is_nought_all_along_is_refused_and_fitted_by_none(noiseless_motions):
    silent = [replace(m, torque=m.torque * [1.0, 0.0]) for m in noiseless_motions]
    with pytest.raises(
        InputError,
        match=r"the torque of the knee is 0 N·m in every row, expected one that varies",
    ):
        identify(silent)


def test_unrealizable_results_are_said(noiseless_motions):
    lighter = [
        replace(m, torque=0.2 * m.torque) if m.run == "with_human" else m for m in noiseless_motions
    ]
    assert any(s.startswith("human: X2") for s in identify(lighter).unrealizable)


def test_friction_that_drives_is_said_where_its_whole_interval_is_below_nought(noiseless_motions):
    """Of the knee's 7.36 N·m·s/rad of viscous friction a drive takes 10 away."""
    less = np.array([0.0, 10.0])
    driven = [
        replace(motion, torque=motion.torque - less * motion.dq) for motion in noiseless_motions
    ]
    (said,) = identify(driven).unrealizable
    assert said.startswith("viscous friction of knee is -2.6")
    assert identify(noiseless_motions).unrealizable == []


def test_without_an_empty_run_friction_cannot_be_fitted(noiseless_motions):
    with pytest.raises(
        InputError, match=r"found no exo_alone run to train on among: with_human_train\.parquet"
    ):
        identify([m for m in noiseless_motions if m.run == "with_human"])


def test_one_run_cannot_be_validated(noiseless_motions):
    with pytest.raises(
        InputError, match=r"found no run to validate on among: exo_alone_train\.parquet"
    ):
        identify(noiseless_motions[:1])


def test_a_validation_run_in_which_one_joint_rests_is_refused_by_its_name(noiseless_motions):
    runs = list(noiseless_motions)
    k = next(k for k, run in enumerate(runs) if run.purpose == "validate")
    speed, acceleration = runs[k].dq.copy(), runs[k].ddq.copy()
    speed[:, 0], acceleration[:, 0] = 0.0, 0.0
    runs[k] = replace(runs[k], dq=speed, ddq=acceleration)
    kept = [run for run in runs if (run.run, run.purpose) != (runs[k].run, "validate")]
    with pytest.raises(InputError, match="at no time do all joints move") as refusal:
        identify([*kept, runs[k]])
    assert str(refusal.value).startswith(runs[k].file)


def test_runs_of_two_machines_are_refused(noiseless_motions):
    other = noiseless_motions[1]
    longer = replace(other, geometry=replace(other.geometry, thigh_length_m=0.45))
    with pytest.raises(
        InputError, match=r"exo_alone_validate.parquet has thigh_length_m 0.45, .* has 0.38952"
    ):
        identify([noiseless_motions[0], longer, *noiseless_motions[2:]])


def test_a_regression_filter_of_another_kind_is_refused_and_never_replaced(noiseless_motions):
    first = noiseless_motions[0]
    foreign = replace(
        first,
        metadata={**first.metadata, "regression_filter": {"kind": "low_pass", "cutoff_hz": 5.0}},
    )
    told = (
        r'exo_alone_train.parquet: metadata regression_filter.kind: found "low_pass", expected'
        r' "block_average"; '
    )
    with pytest.raises(InputError, match=told):
        identify([foreign, *noiseless_motions[1:]])

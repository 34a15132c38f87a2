"""The evidence of a set is that of the Gaussian model it states, and signs count as they should."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_normal, norm

from pipelines.diagnosis.criteria import Criteria
from pipelines.diagnosis.selection.evidence import Element, Evidence, Nonnegative, explained
from pipelines.diagnosis.selection.marginal_likelihood import MarginalLikelihood
from pipelines.diagnosis.selection.posterior import posterior
from tests.campaigns.learn.packing import packed, unpacked

ROWS = 60
CRITERIA = Criteria(drive_weight=1.0, cuff_weight=1.0)

SLOW_NOISE = 1e-6
"""Variance of the coefficient of a curve of time."""


def problem(seed: int = 0, strength: float = 0.0) -> tuple[np.ndarray, np.ndarray, Evidence]:
    """Return columns (rows, 8), a measurement and its evidence: two causes, a law, a background."""
    rng = np.random.default_rng(seed)
    X = rng.normal(size=(ROWS, 8)) * 10.0
    y = rng.normal(size=ROWS) + X[:, 0] * strength
    elements = (
        Element("spring@hip", "spring", "hip", "angle", False, [0], [1.0], [2]),
        Element("drag@knee", "drag", "knee", "speed", False, [1], [1.0]),
        Element("law:angle@hip", "angle", "hip", "angle", True, [3, 4], [0.7, 0.3]),
    )
    background = ((5, 1.0, 0.0), (6, 1.0, 0.0), (7, 0.0, SLOW_NOISE))
    gram, right = np.zeros((2, 8, 8)), np.zeros((2, 8))
    gram[0], right[0] = X.T @ X, X.T @ y
    return X, y, Evidence(gram, right, elements, background, {}, np.zeros(2))


def background_covariance(X: np.ndarray) -> np.ndarray:
    variances = (CRITERIA.background_cause**2, CRITERIA.background_cause**2, SLOW_NOISE)
    return np.eye(ROWS) + sum(v * np.outer(x, x) for v, x in zip(variances, X.T[5:], strict=True))


def test_a_law_has_the_evidence_of_its_gaussian_model():
    X, y, evidence = problem(strength=0.05)
    weigh = MarginalLikelihood(evidence, CRITERIA)
    (size,) = weigh.sizes((2,))
    amplitude = min(CRITERIA.amplitudes, key=lambda a: abs(np.log(a / size)))
    plain = background_covariance(X)
    with_law = plain + amplitude**2 * (
        0.7 * np.outer(X[:, 3], X[:, 3]) + 0.3 * np.outer(X[:, 4], X[:, 4])
    )
    ratio = multivariate_normal.logpdf(y, cov=with_law) - multivariate_normal.logpdf(y, cov=plain)
    assert weigh((2,)) == pytest.approx(
        ratio - np.log(len(CRITERIA.amplitudes)) + CRITERIA.law + CRITERIA.base_rate, abs=1e-8
    )


def test_a_cause_may_differ_by_its_shape():
    X, y, evidence = problem(strength=0.1)
    weigh = MarginalLikelihood(evidence, CRITERIA)
    (size,) = weigh.sizes((0,))
    amplitude = min(CRITERIA.amplitudes, key=lambda a: abs(np.log(a / size)))
    plain = background_covariance(X)
    named = (
        plain
        + amplitude**2 * np.outer(X[:, 0], X[:, 0])
        + CRITERIA.shape_sd**2 * np.outer(X[:, 2], X[:, 2])
    )
    ratio = multivariate_normal.logpdf(y, cov=named) - multivariate_normal.logpdf(y, cov=plain)
    expected = ratio - np.log(len(CRITERIA.amplitudes)) + CRITERIA.cause + CRITERIA.base_rate
    assert weigh((0,)) == pytest.approx(expected, abs=1e-7)


@pytest.mark.parametrize("strength", [-0.2, 0.0, 0.03, 0.2])
def test_a_forbidden_sign_counts_as_half_of_the_prior_that_is_not_there(strength):
    X, y, evidence = problem(strength=strength)
    cause = replace(evidence.elements[0], derivative=[])
    one_way = replace(cause, amplitudes=[[1.0]])
    both = replace(evidence, elements=(cause, *evidence.elements[1:]))
    signed = replace(evidence, elements=(one_way, *evidence.elements[1:]))
    difference = MarginalLikelihood(signed, CRITERIA)((0,)) - MarginalLikelihood(both, CRITERIA)(
        (0,)
    )
    # By sampling the same posterior.
    (size,) = MarginalLikelihood(both, CRITERIA).sizes((0,))
    amplitude = min(CRITERIA.amplitudes, key=lambda a: abs(np.log(a / size)))
    inverse = np.linalg.inv(background_covariance(X))
    variance = 1.0 / (X[:, 0] @ inverse @ X[:, 0] + amplitude**-2)
    mean = variance * X[:, 0] @ inverse @ y
    drawn = np.random.default_rng(1).normal(mean, np.sqrt(variance), 400_000)
    share = np.mean(drawn > 0.0)
    if share > 1e-3:
        assert difference == pytest.approx(np.log(2.0 * share), abs=0.02)
    else:
        assert difference < -5.0


@pytest.mark.parametrize("slope", [0.0, 0.5])
@pytest.mark.parametrize("friction", [0.02, 0.1, 1.0])
def test_a_cause_that_leaves_friction_negative_is_as_improbable_as_that_friction(friction, slope):
    """Friction, a cause and a step along its shape, all alike, in one Gaussian model."""
    rng = np.random.default_rng(3)
    B, A, D = 10.0 * rng.normal(size=(3, ROWS))
    A, D = 0.8 * B + 0.6 * A, slope * B + D
    y = friction * B + 0.05 * (A - 0.8 * B) + rng.normal(size=ROWS)
    imitated = B @ np.column_stack([A, D]) / (B @ B)
    columns = np.column_stack([A, D]) - np.outer(B, imitated)
    gram, right = np.zeros((2, 2, 2)), np.zeros((2, 2))
    gram[0], right[0] = columns.T @ columns, columns.T @ y
    cause = Element("spring@hip", "spring", "hip", "angle", False, [0], [1.0], [1])
    alone, variance = B @ y / (B @ B), 1.0 / (B @ B)
    never = Nonnegative(np.array([alone]), np.array([[variance, 0.0]]), imitated[np.newaxis])
    known = Evidence(gram, right, (cause,), (), {}, np.zeros(2), never)
    weigh, free = (
        MarginalLikelihood(e, CRITERIA) for e in (known, replace(known, nonnegative=None))
    )
    (size,) = weigh.sizes((0,))
    amplitude = min(CRITERIA.amplitudes, key=lambda a: abs(np.log(a / size)))
    together = np.column_stack([B, A, D])
    covariance = np.linalg.inv(
        together.T @ together + np.diag([0.0, amplitude**-2, CRITERIA.shape_sd**-2])
    )
    with_cause = norm.logcdf((covariance @ together.T @ y)[0] / np.sqrt(covariance[0, 0]))
    without = norm.logcdf(alone / np.sqrt(variance))
    assert weigh((0,)) - free((0,)) == pytest.approx(with_cause - without, abs=1e-8)
    assert weigh(()) == free(()) == 0.0


def test_screening_ranks_pairs_as_each_is_weighed_roughly():
    _, _, evidence = problem(strength=0.1)
    weigh = MarginalLikelihood(evidence, CRITERIA)
    pairs, odds = weigh.pairs([0, 1, 2])
    assert len(pairs) == 3
    for pair, value in zip(pairs, odds, strict=True):
        assert value == pytest.approx(weigh.rough(pair.tolist()), abs=1e-9)


def test_what_all_columns_explain_counts_as_noise_by_the_model_error():
    _, _, evidence = problem(strength=0.1)
    criteria = replace(CRITERIA, model_error=0.01)
    inexact = MarginalLikelihood(replace(evidence, explained=np.array([50.0, 0.0])), criteria)
    noisier = MarginalLikelihood(evidence, replace(criteria, drive_weight=1.0 / 1.5))
    for chosen in ((0,), (1,), (0, 2)):
        assert inexact(chosen) == pytest.approx(noisier(chosen), abs=1e-9)


NO_CURVES = np.array([], dtype=int), np.array([]), 0


def test_noise_alone_explains_nothing_beyond_what_noise_does():
    rng = np.random.default_rng(3)
    X = rng.normal(size=(4000, 8))
    noise = [explained(X.T @ X, X.T @ rng.normal(size=4000), *NO_CURVES) for _ in range(50)]
    assert np.mean(noise) < 5.0
    assert explained(X.T @ X, X.T @ (X[:, 0] + rng.normal(size=4000)), *NO_CURVES) == pytest.approx(
        4000, rel=0.1
    )


def test_slow_noise_counts_for_one_a_coefficient_and_what_it_cannot_follow_in_full():
    rng = np.random.default_rng(5)
    time, curves, variance = np.arange(4000), np.arange(20), np.full(20, 0.3**2)
    slow = np.cos(np.pi * np.outer(time / 4000, curves + 1))
    cause = np.sin(0.7 * time)
    X = np.column_stack([slow, cause])

    def explained_of(torque):
        return explained(X.T @ X, X.T @ torque, curves, variance, most=20)

    wander, noise = slow @ rng.normal(0.0, 0.3, 20), rng.normal(size=4000)
    assert wander @ wander > 2000.0
    assert explained_of(noise) < 10.0
    assert 20.0 <= explained_of(wander + noise) < 30.0
    assert explained_of(cause + wander + noise) == pytest.approx(cause @ cause + 20.0, rel=0.1)


def test_probabilities_add_up_to_one_and_nothing_wins_where_nothing_is_hidden():
    silent = [posterior(problem(seed)[2], CRITERIA) for seed in range(20)]
    for weighed in silent:
        assert weighed.probabilities.sum() == pytest.approx(1.0)
    assert np.mean([weighed.nothing > 0.5 for weighed in silent]) == 1.0


def test_a_strong_cause_is_found_and_a_set_that_cannot_be_weighed_is_left_out():
    _, _, evidence = problem(strength=0.5)
    broken = evidence.gram.copy()
    broken[0, 1, 1] = -1e9  # no product of columns: its matrix is not positive definite
    weighed = posterior(replace(evidence, gram=broken), CRITERIA)
    assert weighed.probabilities.sum() == pytest.approx(1.0)
    assert weighed.marginals["spring@hip"] > 0.99
    assert weighed.marginals.get("drag@knee", 0.0) == 0.0


def test_evidence_survives_being_packed():
    _, _, evidence = problem(strength=0.2)
    rng = np.random.default_rng(4)
    friction = Nonnegative(
        np.array([0.3, 0.1]), rng.random((2, 2)), rng.normal(size=(2, evidence.gram.shape[1]))
    )
    evidence = replace(evidence, nonnegative=friction)
    again = unpacked(packed(evidence))
    np.testing.assert_allclose(again.gram, evidence.gram, rtol=1e-6)
    assert again.elements == evidence.elements
    assert again.background == evidence.background
    ours, theirs = posterior(evidence, CRITERIA), posterior(again, CRITERIA)
    assert ours.nothing == pytest.approx(theirs.nothing, rel=1e-3)


def test_bursts_explain_no_rows_and_multiply_the_odds_of_every_set():
    _, _, plain = problem(strength=0.2)
    own = 4.0
    knocks = Element("law:bursts@hip", "bursts", "hip", "time", True, [], [], log_prior=own)
    evidence = replace(plain, elements=(*plain.elements, knocks))
    weigh, number = MarginalLikelihood(evidence, CRITERIA), len(plain.elements)
    assert weigh.log_evidence((number,)) == own
    assert weigh.log_evidence((0, number)) == pytest.approx(weigh.log_evidence((0,)) + own)
    without, with_them = posterior(plain, CRITERIA), posterior(evidence, CRITERIA)
    odds = dict(zip(with_them.sets, with_them.log_odds, strict=True))
    assert len(odds) == 2 * len(without.sets)
    for chosen, value in zip(without.sets, without.log_odds, strict=True):
        assert odds[chosen] == pytest.approx(value)
        further = CRITERIA.further if chosen else CRITERIA.base_rate
        together = odds[(*chosen, number)] - odds[chosen]
        assert together == pytest.approx(own + CRITERIA.law + further)

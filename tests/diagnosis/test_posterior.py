"""Claims about the posterior over sets that hold whatever its criteria are."""

from dataclasses import replace

import numpy as np
import pytest

from pipelines.diagnosis.criteria import Criteria
from pipelines.diagnosis.selection.evidence import Element, Evidence
from pipelines.diagnosis.selection.posterior import Posterior, posterior

ROWS = 80
CRITERIA = Criteria(drive_weight=1.0, cuff_weight=1.0)
NAMES = ("spring", "drag", "ripple")


def cause(name: str, columns: list[int]) -> Element:
    return Element(
        f"{name}@hip", name, "hip", "angle", False, columns, [1.0 / len(columns)] * len(columns)
    )


def evidence_from(X: np.ndarray, y: np.ndarray, elements: tuple[Element, ...], **more) -> Evidence:
    """Return the evidence of rows that are all of drives; the last column is a good rig's."""
    background = ((X.shape[1] - 1, 1.0, 0.0),)
    gram, right = (np.array([part, np.zeros_like(part)]) for part in (X.T @ X, X.T @ y))
    return Evidence(gram, right, elements, background, {}, np.zeros(2), **more)


def problem(seed: int = 0, strength: float = 0.0, noise_columns: int = 0) -> Evidence:
    """Return three causes and a law, of which the first is there with a strength, and causes of
    pure noise."""
    rng = np.random.default_rng(seed)
    X = rng.normal(size=(ROWS, 5)) * 10.0
    y = rng.normal(size=ROWS) + X[:, 0] * strength
    listed = tuple(cause(name, [k]) for k, name in enumerate(NAMES))
    law = Element("law:speed@hip", "speed", "hip", "speed", True, [3], [1.0])
    noise = rng.normal(size=(ROWS, noise_columns)) * 10.0
    others = tuple(cause(f"noise_{k}", [4 + k]) for k in range(noise_columns))
    wide = np.hstack([X[:, :4], noise, X[:, 4:]])
    return evidence_from(wide, y, (*listed, law, *others))


def by_labels(weighed: Posterior) -> dict[frozenset[str], float]:
    return {labels: p for labels, p in weighed.by_labels.items() if p > 1e-12}


def test_an_empty_library_leaves_nothing_that_could_be_missing():
    weighed = posterior(replace(problem(strength=0.5), elements=()), CRITERIA)
    assert weighed.sets == ((),)
    assert weighed.nothing == 1.0
    assert weighed.marginals == {}


def test_what_cannot_be_weighed_is_left_out_and_named():
    """Rounding made the drag's products impossible: its column would have a negative length."""
    evidence = problem(strength=0.3)
    evidence.gram[0][1, 1] = -1e6
    weighed = posterior(evidence, CRITERIA)
    assert sum(weighed.by_labels.values()) == pytest.approx(1.0)
    assert {"drag@hip"} in weighed.unweighed
    assert all("drag@hip" in labels for labels in weighed.unweighed)
    assert weighed.marginals["spring@hip"] > 0.5


@pytest.mark.parametrize("strength", [0.0, 0.08, 0.3])
def test_the_order_of_elements_changes_nothing(strength):
    evidence = problem(strength=strength)
    turned = replace(evidence, elements=evidence.elements[::-1])
    ours, theirs = (by_labels(posterior(one, CRITERIA)) for one in (evidence, turned))
    assert ours.keys() == theirs.keys()
    for labels, p in ours.items():
        assert theirs[labels] == pytest.approx(p, rel=1e-9)


def test_the_order_of_columns_changes_nothing():
    evidence = problem(strength=0.1)
    order = np.random.default_rng(3).permutation(evidence.gram.shape[1])
    place = np.argsort(order).tolist()
    moved = replace(
        evidence,
        gram=evidence.gram[:, order[:, np.newaxis], order],
        right=evidence.right[:, order],
        elements=tuple(
            replace(e, columns=[place[c] for c in e.columns]) for e in evidence.elements
        ),
        background=tuple((place[c], *sizes) for c, *sizes in evidence.background),
    )
    ours, theirs = (by_labels(posterior(one, CRITERIA)) for one in (evidence, moved))
    assert theirs == pytest.approx(ours, rel=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_causes_of_pure_noise_hardly_lower_the_true_causes_probability(seed):
    alone, crowded = (posterior(problem(seed, 0.15, count), CRITERIA) for count in (0, 40))
    assert alone.marginals["spring@hip"] > 0.9
    assert crowded.marginals["spring@hip"] > alone.marginals["spring@hip"] - 0.1


def test_a_cause_that_was_refined_with_others_counts_once_on_its_own():
    """Its shape in the set is there for the set: many such sets make it no likelier that it is
    there alone."""
    evidence = problem(strength=0.08)
    again = [replace(evidence.elements[0], refined_in=number) for number in range(10)]
    count = len(evidence.elements)
    grown = replace(
        evidence,
        elements=(*evidence.elements, *again),
        contexts=tuple((count + number, 1) for number in range(10)),
    )
    ours, theirs = (posterior(one, CRITERIA).by_labels for one in (evidence, grown))
    alone, nothing = frozenset({"spring@hip"}), frozenset()
    assert theirs[alone] / theirs[nothing] == pytest.approx(ours[alone] / ours[nothing])


@pytest.mark.parametrize(
    "criteria", [CRITERIA, Criteria(), replace(CRITERIA, cause=-2.0, law=-2.0, further=0.0)]
)
def test_probabilities_of_sets_add_up_and_no_set_holds_a_label_twice(criteria):
    weighed = posterior(problem(strength=0.1, noise_columns=3), criteria)
    assert weighed.probabilities.sum() == pytest.approx(1.0)
    assert (np.diff(weighed.probabilities) <= 0.0).all()
    for chosen in weighed.sets:
        labels = [weighed.elements[i].label for i in chosen]
        assert len(set(labels)) == len(labels)

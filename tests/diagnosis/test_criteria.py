"""Every hyper-parameter of the posterior decides something, and has the value that it has.

A cause is named from some share of the torque on. That share is recorded for sessions that consist
of a few orthogonal columns each: at 0.3 % less nothing is named, at 0.3 % more the cause is. Each
criterion moves the share of its session out of these bounds when it is changed by half of itself,
or by one log unit.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import brentq

from pipelines.diagnosis import judged_fit as module_of_judged_fit
from pipelines.diagnosis.candidates import library as module_of_library
from pipelines.diagnosis.candidates.candidate import Candidate
from pipelines.diagnosis.criteria import BEFORE_EVIDENCE, CRITERIA, Criteria
from pipelines.diagnosis.diagnosis import Diagnosis
from pipelines.diagnosis.evidence.decision_band import LENGTH_S
from pipelines.diagnosis.fit.validation import ValidationResult
from pipelines.diagnosis.judged_fit import JudgedFit
from pipelines.diagnosis.selection.answer import answer_of
from pipelines.diagnosis.selection.evidence import Element, Evidence, explained
from pipelines.diagnosis.selection.posterior import Posterior, posterior
from pipelines.diagnosis.selection.unlisted_look_alikes import kept_share
from pipelines.model import effect_named
from tests.diagnosis.screening import Screening
from tests.diagnosis.sessions import session

LENGTH = 100.0
"""Of each column over its noise: a share of 0.04 is four standard errors."""
DRIVE, CUFF = 0, 1
WITHIN = 1.003
"""Factor between a recorded share and the bounds on both sides of it."""

CAUSE = Element("spring@hip", "spring", "hip", "angle", False, [0], [1.0])
LAW = Element("law:speed@hip", "speed", "hip", "speed", True, [0], [1.0])
DRAG = Element("drag@hip", "drag", "hip", "speed", False, [1], [1.0])
PUSHES = replace(CAUSE, label="voluntary_torque@hip", name="voluntary_torque")


@dataclass(frozen=True)
class Session:
    """One column for each cause, of which the first has some share and the second a given one."""

    elements: tuple[Element, ...] = (CAUSE,)
    output: int = DRIVE
    second: float = 0.0
    explained: float = 0.0
    """What all columns explain of the output, in units of the noise, squared."""
    on_a_good_rig: bool = False
    """Whether a good rig has some of the cause, too."""
    along_its_shape: bool = False
    """Whether the torque is not that of the cause, but of a change of its shape."""
    auxiliary: Mapping[str, float] | None = None
    lines: float = 0.0
    """Log likelihood ratio of a line at the full sampling rate, per squared share."""

    def evidence(self, share: float) -> Evidence:
        """Return what the decision needs of the session where the first column has a share."""
        shares = np.array([0.0 if self.along_its_shape else share, self.second, 0.0, 0.0])
        elements = self.elements
        if self.along_its_shape:
            shares[2] = share
            elements = (replace(CAUSE, derivative=[2]),)
        if self.lines:
            ratio = max(self.lines * share**2, 1e-9)
            elements = (replace(CAUSE, lines=[(ratio, max(share, 1e-9), 2)]),)
            shares[0] = 0.0
        gram, right = np.zeros((2, 4, 4)), np.zeros((2, 4))
        gram[self.output] = LENGTH**2 * np.eye(4)
        right[self.output] = LENGTH**2 * shares
        background = ((0 if self.on_a_good_rig else 3, 1.0, 0.0),)
        of_outputs = np.zeros(2)
        of_outputs[self.output] = self.explained
        return Evidence(gram, right, elements, background, self.auxiliary or {}, of_outputs)

    def least_share(self, criteria: Criteria = CRITERIA) -> float:
        """Return the share from which on the first cause is more probable than not."""
        label = self.elements[0].label

        def lacking(log_share: float) -> float:
            weighed = posterior(self.evidence(float(np.exp(log_share))), criteria)
            return weighed.marginals[label] - 0.5

        low, high = np.log(1e-4), np.log(30.0)
        if lacking(low) > 0.0:
            return 0.0
        return float(np.exp(brentq(lacking, low, high))) if lacking(high) > 0.0 else np.inf


SESSIONS: Mapping[str, tuple[Session, float]] = {
    "cause": (Session(), 0.03472),
    "law": (Session((LAW,)), 0.03547),
    "further": (Session((CAUSE, DRAG), second=0.5), 0.03526),
    "searched": (Session((replace(CAUSE, log_searched=6.0),)), 0.04374),
    "each_run": (Session((replace(CAUSE, each_run=True),)), 0.04078),
    "worn": (Session((replace(CAUSE, worn=True),)), 0.04546),
    "coherence_weight": (Session((PUSHES,), auxiliary={PUSHES.label: 6.0}), 0.02691),
    "base_rate": (Session(), 0.03472),
    "drive_weight": (Session(), 0.03472),
    "cuff_weight": (Session(output=CUFF), 0.10156),
    "model_error": (Session(explained=1000.0), 0.10843),
    "cuff_model_error": (Session(output=CUFF, explained=3000.0), 0.27012),
    "amplitudes": (Session(), 0.03472),
    "shape_sd": (Session(along_its_shape=True), 0.04243),
    "background_cause": (Session(on_a_good_rig=True), 0.03637),
    "background_line": (Session(lines=2e6), 0.02207),
    "line_weight": (Session(lines=2e6), 0.02207),
}
"""For each criterion of the posterior a session that it decides, and its least share."""
LOG_ODDS = ("cause", "law", "further", "each_run", "worn", "base_rate")
OTHERS = (
    "named_from",
    "tied_from",
    "look_alike",
    "at_floor",
    "left_of_explained",
    "predicted_better",
    "shape_freedom",
    *BEFORE_EVIDENCE,
)
"""Criteria with a test of their own below."""


def changed(name: str, by: float) -> Criteria:
    """Return the criteria with one of them larger or smaller by half, or by one log unit."""
    value = getattr(CRITERIA, name)
    if name in LOG_ODDS:
        return replace(CRITERIA, **{name: value + by})
    factor = 1.0 + 0.5 * by
    scaled = tuple(factor * v for v in value) if isinstance(value, tuple) else factor * value
    return replace(CRITERIA, **{name: scaled})


def test_every_criterion_has_a_test():
    assert {field.name for field in fields(Criteria)} == {*SESSIONS, *OTHERS}


@pytest.mark.parametrize("name", SESSIONS)
def test_a_cause_is_named_from_the_recorded_share_on(name):
    session, share = SESSIONS[name]
    label = session.elements[0].label
    less, more = (
        posterior(session.evidence(share * factor)).marginals[label]
        for factor in (1.0 / WITHIN, WITHIN)
    )
    assert less < CRITERIA.named_from < more


@pytest.mark.parametrize("by", [-1.0, 1.0])
@pytest.mark.parametrize("name", SESSIONS)
def test_another_criterion_moves_the_share_out_of_its_bounds(name, by):
    session, share = SESSIONS[name]
    assert abs(np.log(session.least_share(changed(name, by)) / share)) > np.log(WITHIN)


def weighed(*probabilities: float) -> Posterior:
    """Return a posterior of single causes with some probabilities; the rest is that of nothing."""
    nothing = 1.0 - sum(probabilities)
    sets = tuple((k,) for k in range(len(probabilities)))
    odds = np.log(np.array([nothing, *probabilities]) / nothing)
    return Posterior((CAUSE, DRAG)[: len(sets)], ((), *sets), odds)


def test_a_cause_is_named_where_it_is_as_likely_as_not():
    assert answer_of(weighed(0.51)).labels == (CAUSE.label,)
    assert answer_of(weighed(0.49)).labels == ()


def test_a_cause_of_a_tenth_of_the_named_ones_probability_is_its_tie():
    (named,) = answer_of(weighed(0.8, 0.084)).named
    assert [label for label, _ in named.ties] == [DRAG.label]
    (named,) = answer_of(weighed(0.8, 0.076)).named
    assert named.ties == ()


def test_a_cause_that_removes_a_sixth_of_the_error_is_as_likely_a_look_alike():
    assert kept_share(0.15) < 0.5 < kept_share(0.17)
    assert kept_share(1.0) == pytest.approx(0.988, abs=0.002)


def test_an_error_within_three_percent_of_the_floor_is_noise():
    validated = SimpleNamespace(errors=SimpleNamespace(rms=np.array([1.029, 1.031])))
    assert ValidationResult.above(validated, SimpleNamespace(rms=np.ones(2))).tolist() == [
        False,
        True,
    ]


def test_a_joint_is_explained_where_a_fifth_of_the_systematic_power_is_left():
    ends = SimpleNamespace(
        unexplained=[0.19, 0.21], floor=None, after=SimpleNamespace(above=lambda _: [True, True])
    )
    assert Diagnosis.left_over.fget(ends) == [False, True]


def test_an_answer_by_all_runs_gains_a_log_unit_on_the_validation_runs(monkeypatch):
    monkeypatch.setattr(module_of_judged_fit, "gain", lambda *_: SimpleNamespace(low=1.0))
    monkeypatch.setattr(module_of_judged_fit, "log_likelihoods", lambda model, _: model.logs)

    def model(*logs):
        return SimpleNamespace(logs=np.array(logs), errors=None)

    better = [
        JudgedFit.predicts_better_than(SimpleNamespace(after=model(*own)), model(0.0, 0.0), None)
        for own in ((0.9, 0.0), (2.0, -0.9))
    ]
    assert better == [False, True]


def test_a_shape_far_off_its_usual_range_costs_little():
    """Of one and of nine degrees of freedom it would cost 2.8 and 5.1 log units."""
    delay = effect_named("time_delay")(joint="hip")
    low, high = delay.shape[0].typical
    middle, beyond = 0.5 * (low + high), high + 0.5 * (high - low)
    usual, far = (Candidate(delay, ((seconds,),)).log_prior for seconds in (middle, beyond))
    assert usual - far == pytest.approx(3.69, abs=0.05)


def test_what_columns_explain_is_weighed_with_a_prior_share():
    # One column of length 10 that explains 30: 30² / (10 + 1 / 0.3²), less that of noise alone.
    value = explained(np.array([[10.0]]), np.array([30.0]), np.zeros(0), np.zeros(0), 0)
    assert value == pytest.approx(42.16, abs=0.05)


def test_a_tenth_of_the_residual_counts_as_noise(monkeypatch):
    monkeypatch.setattr(module_of_library, "_effects", lambda prepared: [])
    monkeypatch.setattr(module_of_library, "_ripples", lambda *_: [])
    prepared = Screening.of(session()).prepared
    regression = module_of_library.build_library(prepared).regression
    noise, _ = prepared.noise.averaged(LENGTH_S)
    for root, band in zip(regression.roots, regression.bands, strict=True):
        there = band.weight > 0.0
        sigma = np.where(there, np.sqrt(band.weight) / np.where(there, root, 1.0), np.nan)
        expected = np.hypot(noise, 0.1 * prepared.slow_rms)
        np.testing.assert_allclose(sigma[there], np.broadcast_to(expected, there.shape)[there])

"""Which explanation is taken where several are as good as one another on what was fitted."""

from dataclasses import replace

import numpy as np
import pytest

from pipelines.diagnosis.candidates import Candidate
from pipelines.diagnosis.choice import NEEDED, Choice, Ranked
from pipelines.diagnosis.evaluate import evaluate
from pipelines.diagnosis.fit import Fit, fit
from pipelines.diagnosis.observations import baseline_of, observe
from pipelines.effects import PayloadChange, QuadraticDrag, StribeckFriction, TorqueGain
from tests.diagnosis.sessions import session


def ranked(effect, score):
    made = Fit((Candidate(effect, ((),)),), np.zeros(1), np.ones(2), np.ones(2), 0.0, ("exo_alone",))
    return Ranked(made, score)


def choice_of(*level):
    by_labels = {r.labels: r for r in level}
    return Choice(level[0], [], [{}, by_labels], np.ones(2))


def test_a_refuted_set_gives_way_to_one_that_training_hardly_tells_from_it_and_to_no_other():
    drag, stribeck, gain = QuadraticDrag(joint="knee"), StribeckFriction(joint="knee"), TorqueGain(joint="knee")
    first = choice_of(ranked(drag, 100.0), ranked(stribeck, 100.0 - 0.5 * NEEDED), ranked(gain, 100.0 - 2 * NEEDED))
    second = first.next_best()
    assert second.named.labels == ("stribeck_friction@knee",)
    assert second.refuted == {("quadratic_drag@knee",)}
    assert second.next_best() is None


@pytest.mark.parametrize("instant", [7.3, 18.6, 33.1])
def test_what_comes_at_an_instant_of_a_validation_run_is_dated_within_a_second(instant):
    train, validate = session("payload_change", "knee", seconds=40.0, mass_moment=0.5, time=instant)[:2]
    baseline = baseline_of([observe(train)])
    learnt = Candidate(PayloadChange(joint="knee"), ((instant, 0.3),))
    made = fit([learnt], [observe(train)], baseline, np.array([1.0, 1.0, 0.0, 0.0]))
    run = observe(validate)
    # Nothing tells when it comes in this run, but its own samples.
    elsewhere = replace(made, causes=(Candidate(PayloadChange(joint="knee"), ((0.5 * instant, 0.3),)),))
    known = evaluate(made, [run], baseline)[0]
    found = evaluate(elsewhere, [run], baseline)[0]
    rms = [np.sqrt(np.mean(r[run.usable[:, 1], 1] ** 2)) for r in (known, found)]
    assert rms[1] == pytest.approx(rms[0], rel=0.02)

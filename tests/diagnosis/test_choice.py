"""Which explanation is taken where several are as good as one another on what was fitted."""

from dataclasses import replace

import numpy as np
import pytest

from pipelines.diagnosis.bank import fill
from pipelines.diagnosis.candidates import Candidate, columns_under
from pipelines.diagnosis.choice import NEEDED, Choice, Ranked, choose, idle
from pipelines.diagnosis.evaluate import evaluate
from pipelines.diagnosis.fit import Fit, fit, residuals_on
from pipelines.diagnosis.floor import noise_floor
from pipelines.diagnosis.observations import baseline_of, observe, with_load
from pipelines.diagnosis.perceived import heard_in
from pipelines.diagnosis.search import Scored, Scorer
from pipelines.effects import PayloadChange, QuadraticDrag, StribeckFriction
from pipelines.mechanics.kinematics import motion_table
from pipelines.mechanics.motion import motion_from_table
from pipelines.mechanics.scale import on_one_scale
from pipelines.model import ParameterLayout
from pipelines.settings.filter import FilterSettings
from tests.diagnosis.machines import pendulum
from tests.diagnosis.sessions import session


def ranked(effect, score):
    made = Fit(
        (Candidate(effect, ((),)),),
        np.zeros(1),
        np.ones(2),
        np.ones(2),
        0.0,
        ParameterLayout.of([effect], ["exo_alone"]),
        np.zeros((2, 1)),
        np.eye(1),
    )
    return Ranked(made, score)


def test_a_refuted_set_gives_way_to_those_as_good_and_then_to_nothing():
    drag, stribeck = ranked(QuadraticDrag(joint="knee"), 100.0), ranked(StribeckFriction(joint="knee"), 97.0)
    first = Choice(drag, [], [{}, {r.labels: r for r in (drag, stribeck)}], np.ones(2), standby=(stribeck,))
    second = first.next_best()
    assert second.named.labels == ("stribeck_friction@knee",)
    assert second.refuted == {("quadratic_drag@knee",)}
    assert second.next_best() is None
    none = second.none_left(drag.fit)
    assert none.refuted == {("quadratic_drag@knee",), ("stribeck_friction@knee",)}


def test_what_was_heard_stays_when_what_stood_beside_it_is_refuted():
    drag, both = ranked(QuadraticDrag(joint="knee"), 50.0), ranked(QuadraticDrag(joint="knee"), 60.0)
    play = Candidate(StribeckFriction(joint="hip"), ((),))
    both = Ranked(replace(both.fit, causes=(*both.fit.causes, play)), 60.0)
    choice = Choice(both, [], [{}, {drag.labels: drag}, {both.labels: both}], np.ones(2))
    assert choice.just(["quadratic_drag@knee"]).named is drag
    assert choice.just(["quadratic_drag@knee"]).refuted == {both.labels}
    assert choice.just([]) is None
    assert choice.just(both.labels) is None, "that is what was refuted"


def scored(score):
    return Scored((0,), score, np.ones(2))


def test_a_rival_that_explains_nothing_is_no_tie_however_little_is_known():
    """Of the sets with another cause in the named one's place, those that are no better than the rest without any."""
    drag, both = ranked(QuadraticDrag(joint="knee"), 50.0), ranked(QuadraticDrag(joint="knee"), 80.0)
    play = Candidate(StribeckFriction(joint="hip"), ((),))
    both = Ranked(replace(both.fit, causes=(*both.fit.causes, play)), 80.0)
    label, at = "quadratic_drag@knee", "stribeck_friction@hip"
    singles = {(label,): scored(48.0), (at,): scored(20.0), ("base_tilt",): scored(-3.0), ("cogging@hip",): scored(4.0)}
    pairs = {
        both.labels: scored(79.0), (label, "spasticity@hip"): scored(70.0), ("base_tilt", label): scored(49.0),
        ("cogging@hip", at): scored(90.0),
    }  # fmt: skip
    alone = Choice(drag, [singles], [{}, {drag.labels: drag}], np.ones(2))
    assert idle(alone, label) == {"base_tilt"}
    two = Choice(both, [singles, pairs], [{}, {drag.labels: drag}, {both.labels: both}], np.ones(2))
    assert idle(two, at) == {"base_tilt"}, "beside the drag, which alone gains 50"
    assert idle(two, label) == frozenset(), "beside the other, which alone gains 20"


def test_what_training_hardly_shows_stands_for_other_runs_to_decide_where_nothing_was_named_or_refuted():
    likely = [ranked(QuadraticDrag(joint="knee"), 15.0), ranked(StribeckFriction(joint="knee"), 11.0)]
    others = [ranked(StribeckFriction(joint="hip"), 7.0), ranked(QuadraticDrag(joint="hip"), 5.0)]
    none = Ranked(replace(likely[0].fit, causes=()), 0.0)
    choice = Choice(none, [], [{(): none}, {r.labels: r for r in (*likely, *others)}], np.ones(2))
    faint = choice.faint()
    assert (faint.named, *faint.standby) == tuple(likely)
    assert replace(choice, refined=[{(): none}, {r.labels: r for r in others[1:]}]).faint() is None, "not likely"
    assert replace(choice, refuted=frozenset({likely[0].labels})).faint() is None
    assert faint.faint() is None, "something is named"


@pytest.fixture(scope="module")
def offset():
    """A bank of a leg whose hip torque is read 3 N·m too high."""
    runs = [observe(m) for m in session("torque_offset", "hip", seconds=40.0, offset=3.0) if m.purpose == "train"]
    return fill(runs, baseline_of(runs))


def test_only_what_training_hardly_tells_from_the_named_set_stands_by(offset):
    empty = fit((), offset.runs, offset.baseline, offset.weights)
    choice = choose(offset, noise_floor(offset.runs, residuals_on(empty, offset.runs, offset.baseline)), {})
    assert choice.named.score > 100.0
    assert all(choice.named.score - NEEDED < r.score <= choice.named.score for r in choice.standby)
    assert {r.labels for r in (choice.named, *choice.standby)} >= {("coulomb_asymmetry@hip",), ("torque_offset@hip",)}


def test_an_amplitude_whose_sign_is_forbidden_stands_at_nought(offset):
    scorer = Scorer(offset, np.full(4, 500.0), {})
    springs = [i for i, c in enumerate(offset.candidates) if c.label == "parallel_spring@hip"]
    offsets = [i for i, c in enumerate(offset.candidates) if c.label == "torque_offset@hip"]
    spring, plain = scorer((springs[0],)), scorer((offsets[0],))
    # Of the spring no more than its preload is left, or a stiffness that does not matter; it costs an amplitude more.
    assert plain.score - 10.0 < spring.score < plain.score
    drag = [i for i, c in enumerate(offset.candidates) if c.label == "rotor_inertia@knee"]
    negative = replace(offset, gram=replace(offset.gram, measured=-offset.gram.measured))
    scores = [Scorer(bank, np.full(4, 500.0), {})((drag[0],)).score for bank in (offset, negative)]
    assert not all(np.isfinite(scores)), "of a cause with one amplitude nothing is left"


@pytest.fixture(scope="module")
def uneven():
    """A run of a pendulum whose viscous friction differs with direction."""
    table = pendulum("train", 1, asymmetry=0.1)
    (motion,) = on_one_scale([motion_from_table(motion_table(table, FilterSettings()))])
    return observe(motion)


def chosen(run, heard=None):
    """Return the causes chosen of one run, and what was heard in it if nothing else is told."""
    bank = fill([run], baseline_of([run]))
    left = residuals_on(fit((), bank.runs, bank.baseline, bank.weights), bank.runs, bank.baseline)
    heard = heard or heard_in(bank.runs, left)
    return choose(bank, noise_floor(bank.runs, left), heard).named.labels, heard


def test_bursts_that_go_with_another_cause_name_no_play(uneven):
    labels, _ = chosen(uneven, {"backlash@arm": 30.0})
    assert labels == ("viscous_asymmetry@arm",)


def test_bursts_that_stay_beside_another_cause_name_play(uneven):
    baseline = baseline_of([uneven])
    plain = fit((), [uneven], baseline, np.ones(2))
    positive = uneven.average(with_load(uneven, baseline, plain.values).motion.load)[:, 0] > 0
    loud = uneven.measured.copy()
    noise = np.random.default_rng(1)
    for at in np.flatnonzero(np.diff(positive)):
        after = loud[at : at + 8, 0]
        after += 0.15 * noise.normal(size=len(after))
    labels, heard = chosen(replace(uneven, measured=loud))
    assert heard["backlash@arm"] > NEEDED
    assert labels == ("backlash@arm", "viscous_asymmetry@arm")


@pytest.mark.parametrize("instant", [7.3, 18.6, 33.1])
def test_what_comes_at_an_instant_of_a_validation_run_is_dated_within_a_second(instant):
    train, validate = session("payload_change", "knee", seconds=40.0, mass_moment=0.5, time=instant)[:2]
    baseline = baseline_of([observe(train)])
    learnt = Candidate(PayloadChange(joint="knee"), ((instant, 0.3),))
    made = fit([learnt], [observe(train)], baseline, np.array([1.0, 1.0, 0.0, 0.0]))
    run = observe(validate)
    # Nothing tells when it comes in this run, but its own samples.
    elsewhere = replace(made, causes=(Candidate(PayloadChange(joint="knee"), ((0.5 * instant, 0.3),)),))
    found = evaluate(elsewhere, [run], baseline)[0]
    columns, measured = columns_under([learnt.term(0)], run, baseline)
    known = measured - columns @ made.values
    rms = [np.sqrt(np.mean(r[run.usable[:, 1], 1] ** 2)) for r in (known, found)]
    assert rms[1] < 1.02 * rms[0]

"""Sessions are recorded under as many conditions as are promised, and files say which."""

from collections import Counter

import numpy as np
import pytest

from tests.campaigns.blind import conditions as c
from tests.campaigns.blind import recorder
from tests.campaigns.blind.cases import mixed
from tests.campaigns.blind.causes import HUMAN_CAUSES
from tests.campaigns.blind.conditions import Conditions, random_conditions
from tests.campaigns.blind.temperature import Warmth
from tests.campaigns.blind.worlds import WORLDS

SEED = 900_500
DRAWS = 4000
NEAR = 0.025
"""Three standard errors of a share of so many draws, at most."""


@pytest.fixture(scope="module")
def drawn():
    rng = np.random.default_rng(SEED)
    return [random_conditions(rng) for _ in range(DRAWS)]


def share(drawn, holds):
    return np.mean([holds(one) for one in drawn])


@pytest.mark.parametrize("rate", c.RATES_HZ)
def test_sample_rates_occur_as_often_as_stated(drawn, rate):
    observed = share(drawn, lambda one: one.rate_hz == rate)
    assert observed == pytest.approx(c.RATES_HZ[rate], abs=NEAR)


def test_a_quarter_of_the_sessions_says_no_period_and_half_of_those_have_none(drawn):
    without = [one for one in drawn if not one.says_period]
    assert len(without) / DRAWS == pytest.approx(c.WITHOUT_PERIOD, abs=NEAR)
    aperiodic = share(without, lambda one: not one.periodic)
    assert aperiodic == pytest.approx(c.APERIODIC, abs=2 * NEAR)
    assert all(one.periodic for one in drawn if one.says_period)


def test_lengths_and_sensors_occur_as_often_as_stated(drawn):
    assert share(drawn, lambda one: one.duration_s <= c.SHORT_S[1]) == pytest.approx(
        c.SHORT, abs=NEAR
    )
    assert share(drawn, lambda one: not one.has_cuffs) == pytest.approx(c.WITHOUT_CUFFS, abs=NEAR)
    assert share(drawn, lambda one: one.gaps > 0) == pytest.approx(c.WITH_GAPS, abs=NEAR)
    assert {one.duration_s for one in drawn} >= set(c.USUAL_S)
    assert 20.0 <= min(one.duration_s for one in drawn) <= max(o.duration_s for o in drawn) <= 120.0


def test_a_fifth_of_the_sessions_has_one_kind_of_run():
    cases = mixed(1500, SEED, worlds=tuple(WORLDS))
    one = [case for case in cases if len(case.kinds) == 1]
    assert len(one) / len(cases) == pytest.approx(c.ONE_KIND, abs=3 * NEAR / 2)
    # What a person does is hidden where there is one.
    human = [s for s in one if any(effect in HUMAN_CAUSES for effect, _ in s.hidden)]
    assert human and all(case.kinds == ("with_human",) for case in human)


def test_worlds_have_as_many_cases_each_and_hide_different_things():
    cases = mixed(90, SEED, worlds=tuple(WORLDS))
    assert set(Counter(case.world for case in cases).values()) == {30}
    hidden = [{case.hidden for case in cases if case.world == world} for world in WORLDS]
    assert len(hidden[0] & hidden[1] & hidden[2]) < 8


def test_what_was_lost_is_what_the_file_says():
    time = np.arange(4000) * 0.005
    columns = {"time_s": time.copy(), "hip_angle_rad": np.sin(time)}
    kept, gaps = recorder.with_gaps(columns, 3, np.random.default_rng(SEED))
    assert len(gaps) == 3
    assert len(kept["time_s"]) == len(time) - sum(missing for _, missing in gaps)
    for first, missing in gaps:
        k = np.searchsorted(time, first - 1e-9)
        assert not np.isin(time[k : k + missing], kept["time_s"]).any()
        assert np.isin(time[[k - 1, k + missing]], kept["time_s"]).all()


def test_a_file_leaves_out_what_its_recorder_has_not():
    metadata = {"controller": {}, "geometry": {"thigh_length_m": 0.4, "thigh_cuff_distance_m": 0.2}}
    bare = Conditions(rate_hz=100.0, has_controller=False, has_cuffs=False, says_period=False)
    assert recorder.header(dict(metadata), bare, 10.0) == {
        "sample_rate_hz": 100.0,
        "geometry": {"thigh_length_m": 0.4},
    }
    assert recorder.header(dict(metadata), Conditions(), 10.0)["period_s"] == 10.0


def test_motors_are_warmer_in_later_runs():
    warmth = Warmth(np.random.default_rng(SEED), 4)
    starts = np.array([warmth.curve(run, 60.0)[0] for run in warmth.order.argsort()])
    assert np.all(np.diff(starts, axis=0) > 0)
    coldest, warmest = warmth.range(dict.fromkeys(range(4), 60.0))
    assert np.all(warmest - coldest > 1.5)

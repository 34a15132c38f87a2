"""A bumper whose exponent lies between those that are tried: its intervals still hold the truth."""

import pytest

from pipelines.diagnosis.diagnose import diagnose
from pipelines.diagnosis.verdict.verdict import verdict
from tests.diagnosis.sessions import session

BUMPER = {"stiffness": 12.0, "contact_angle": -0.75, "exponent": 1.75}


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_intervals_hold_a_truth_between_two_forms_and_are_not_wide_open(seed):
    outcome = verdict(diagnose(session("end_stop", "knee", seed=seed, direction=1.0, **BUMPER)))
    (cause,) = outcome["causes"]
    assert (cause["effect"], cause["joint"]) == ("end_stop", "knee")
    intervals = {parameter["name"]: parameter["ci95"] for parameter in cause["parameters"]}
    for name, true in BUMPER.items():
        low, high = intervals[name]
        assert low <= true <= high, name
    low, high = intervals["contact_angle"]
    assert high - low < 0.2
    # A side is a side: nothing lies between.
    assert intervals["direction"] == [1.0, 1.0]

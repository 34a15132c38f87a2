"""No sound session is stopped, and faults of a tenth of the error are named: a few of them."""

from dataclasses import replace
from pathlib import Path

import pytest

from tests.campaigns.vetoes.examination import Outcome, outcomes
from tests.campaigns.vetoes.page import page
from tests.campaigns.vetoes.spoil import SPOILERS
from tests.diagnosis.sessions import recordings


@pytest.fixture(scope="module")
def examined() -> list[Outcome]:
    """A leg with friction that grows with load, as it is and with each fault."""
    tables = recordings("load_dependent_friction", "knee", seed=3, load_coefficient=0.2)[:2]
    named = [replace(t, path=Path(f"run_{i}.parquet")) for i, t in enumerate(tables)]
    return list(outcomes(named, "plant", "0", "load_dependent_friction", 0, len(SPOILERS)))


def test_a_session_that_hides_physics_is_not_stopped(examined):
    sound, *spoilt = examined
    assert sound.fault is None and sound.vetoes == () and sound.others == ()
    assert {one.fault for one in spoilt} == {spoiler.name for spoiler in SPOILERS}


def test_every_fault_of_a_tenth_of_the_error_is_named(examined):
    large = [one for one in examined if one.share >= 0.1]
    assert len(large) >= 8
    assert [one.fault for one in large if not one.named] == []


def test_the_page_counts_what_was_examined(examined):
    missed = replace(examined[1], share=0.5, named=False)
    text = page([examined[0], missed], "make vetoes")
    assert "| sound sessions stopped | <= 1 % | 0.0 % of 1" in text
    assert "| 0.0 % of 1 (0 to 79) | **no** |" in text and "share 0.50" in text

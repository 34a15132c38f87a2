"""Examinations hide what they promise."""

from collections import Counter

from tests.campaigns.blind.cases import MIX, SINGLES, full, mixed, of_one_joint
from tests.campaigns.blind.causes import HUMAN_CAUSES
from tests.campaigns.blind.examine import drawn
from tests.campaigns.blind.mechanisms import ONE_JOINT
from tests.campaigns.blind.outside import OF_ONE_JOINT
from tests.campaigns.blind.seeds import uses


def test_a_mixed_examination_has_all_categories_and_every_cause():
    cases = mixed(300, 900_000)
    counts = Counter(c.category for c in cases)
    assert len(cases) == 300
    assert all(abs(counts[category] - 300 * share) <= 6 for category, share in MIX.items())
    assert {c.hidden[0] for c in cases if c.category == "single"} == set(SINGLES)


def test_a_full_examination_hides_each_cause_and_joint_thirty_times():
    cases = full(900_000)
    counts = Counter(c.hidden for c in cases)
    assert counts.pop(()) == 300
    assert set(counts.values()) == {30}
    assert len(counts) == len(SINGLES)


def test_no_seed_is_used_twice_and_the_ranges_have_room():
    seeds = [c.seed for c in full(100_000)]
    assert len(set(seeds)) == len(seeds)
    assert max(seeds) < 500_000


def test_causes_of_the_person_are_hidden_where_there_is_one():
    for c in full(900_000):
        if any(effect in HUMAN_CAUSES for effect, _ in c.hidden):
            assert "with_human" in c.kinds


def test_machines_of_one_joint_take_turns_and_hide_what_each_can_have():
    cases = of_one_joint(300, 900_000)
    singles = {(c.machine, c.hidden[0][0]) for c in cases if c.category == "single"}
    assert singles == {
        (name, effect) for name, machine in ONE_JOINT.items() for effect in machine.effects
    }
    assert {c.hidden[0][0] for c in cases if c.category == "outside"} == {
        f"outside:{k}" for k in OF_ONE_JOINT
    }
    assert {c.machine for c in cases if c.category == "none"} == set(ONE_JOINT)


def test_a_part_of_an_examination_is_drawn_at_random_and_a_larger_part_holds_a_smaller():
    cases = mixed(300, 900_000)
    part, more = drawn(cases, 60), drawn(cases, 120)
    assert more[:60] == part
    assert set(drawn(cases, 1000)) == set(cases)
    share = sum(c.category == "single" for c in part) / 60
    assert abs(share - MIX["single"]) < 0.15


def test_seeds_whose_cases_were_read_are_for_tuning():
    assert uses([839_999, 840_360]) == {"reporting"}
    assert uses([840_000, 840_359]) == {"tuning"}

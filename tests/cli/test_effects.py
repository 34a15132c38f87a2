"""``exoid effects``: a list, a page, and help with a name."""

import json

import pytest

from pipelines.effects import EFFECTS


def test_the_list_names_every_effect_with_equation_and_size(exoid):
    outcome = exoid("effects")
    assert outcome.code == 0
    output = " ".join(outcome.out.split())
    for effect in EFFECTS:
        assert effect.name in output
        assert " ".join(effect.equation.split()) in output
    assert "stribeck_torque 0.3 to 6 N·m" in output
    assert max(map(len, outcome.out.splitlines())) <= 80


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.name)
def test_a_page_tells_how_to_see_it_and_how_to_make_sure(exoid, effect):
    outcome = exoid("effects", effect.name)
    assert outcome.code == 0
    for message in (effect.equation, effect.looks_like, effect.confirm, effect.source):
        assert " ".join(message.split()) in " ".join(outcome.out.split())
    assert max(map(len, outcome.out.splitlines())) <= 80


def test_programs_get_the_same_as_json(exoid):
    descriptions = json.loads(exoid("effects", "--json").out)
    assert [one["effect"] for one in descriptions] == [effect.name for effect in EFFECTS]
    page = json.loads(exoid("effects", "cogging", "--json").out)
    assert [p["name"] for p in page["parameters"]] == ["amplitude", "cycles_per_turn", "phase"]


def test_a_mistyped_name_is_mended(exoid):
    outcome = exoid("effects", "stribek_friction")
    assert outcome.code == 2
    assert (
        outcome.err
        == "exoid: there is no effect 'stribek_friction'; did you mean stribeck_friction?\n"
    )

"""docs/contracts.md names the causes; the effects keep to it."""

import re
from pathlib import Path

import pytest

from pipelines.effects import EFFECTS, Parameter

PAGE = (Path(__file__).parents[2] / "docs" / "contracts.md").read_text(encoding="utf-8")
ROWS = [
    [cell.strip() for cell in line.strip("|").split("|")]
    for line in PAGE.partition("## The causes' names")[2].splitlines()
    if line.startswith("| `")
]
BY_NAME = {effect.name: effect for effect in EFFECTS}


def test_every_cause_is_an_effect_and_every_effect_a_cause_or_the_baseline():
    causes = {row[0].strip("`") for row in ROWS}
    effects = {effect.name for effect in EFFECTS} - {"rigid_body", "friction"}
    assert causes >= effects, "add these to the table of causes in docs/contracts.md"
    assert effects >= causes, "the contract names these, and pipelines/effects/ lacks them"


def test_a_unit_that_exoid_cannot_convert_for_a_slide_is_refused_and_one_of_no_joint_is_not():
    about = {"meaning": "a number", "symbol": "c", "typical": (0.0, 1.0)}
    for unit in ("mN·m", "mrad/s", "N·m/turn", "N·m/rad^2"):
        with pytest.raises(ValueError, match=rf"drag: found the unit {re.escape(unit)}, expected"):
            Parameter("drag", unit, **about)
    free = ("1/°C", "Hz", "s")
    assert tuple(Parameter("x", unit, **about).unit for unit in free) == free
    assert Parameter("phase", "rad²", of_joint=False, **about).unit == "rad²"
    # cycles a turn, of a slide
    assert Parameter("cycles", "rad/m", **about).unit == "rad/m"


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row[0].strip("`"))
def test_an_effect_has_the_joints_side_and_parameters_of_the_contract(row):
    name, joints, _, side, parameters = row
    effect = BY_NAME[name.strip("`")]
    assert effect.side.value == side
    assert effect.whole_leg == (joints == "none")
    assert effect.joints == (("knee",) if joints.startswith("knee") else None)
    promised = re.findall(r"`(\w+)`", parameters)
    given = effect().parameters
    assert [p.name for p in given[: len(promised)]] == promised
    # What the contract does not name may be left out of a file.
    assert all(p.default is not None for p in given[len(promised) :])


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row[0].strip("`"))
def test_human_causes_need_a_human(row):
    effect = BY_NAME[row[0].strip("`")]
    assert effect.acts_in == (("with_human",) if row[3] == "human" else ("exo_alone", "with_human"))

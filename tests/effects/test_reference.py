"""docs/effects is what the effects say of themselves."""

from pathlib import Path

import pytest

from pipelines.effects import EFFECTS
from pipelines.effects.reference import pages

FOLDER = Path(__file__).parents[2] / "docs" / "effects"


def test_the_pages_are_up_to_date():
    written = {path.name: path.read_text(encoding="utf-8") for path in FOLDER.glob("*.md")}
    assert written == pages(), "run `make docs`"


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.name)
def test_a_page_says_all_about_an_effect(effect):
    page = pages()[f"{effect.name}.md"]
    for told in (
        effect.equation,
        effect.looks_like,
        effect.confirm,
        effect.source,
        effect.side.value,
    ):
        assert told in page
    assert effect.forms_differ in page and f"**Family:** {effect.family.value};" in page
    for parameter in effect().parameters:
        assert f"`{parameter.name}`" in page

"""docs/criteria.md tells every number that decides, as it is in force."""

from dataclasses import fields
from pathlib import Path

from pipelines.diagnosis.criteria import Criteria
from pipelines.diagnosis.reference import meanings, reference

PAGE = Path(__file__).parents[2] / "docs" / "criteria.md"


def test_every_number_has_a_meaning():
    assert set(meanings()) == {field.name for field in fields(Criteria)}


def test_the_page_is_up_to_date():
    assert PAGE.read_text(encoding="utf-8") == reference(), "run `make docs`"

"""docs/criteria.md has the current value of every number that decides."""

from dataclasses import fields
from pathlib import Path

from pipelines.diagnosis.criteria import Criteria
from pipelines.diagnosis.reference import HEADINGS, MEASURED, meanings, numbers_of, reference

PAGE = Path(__file__).parents[2] / "docs" / "criteria.md"


def test_every_number_has_a_meaning():
    assert set(meanings()) == {field.name for field in fields(Criteria)}


def test_every_other_number_has_a_meaning():
    numbers = [number for folder in HEADINGS for number in numbers_of(folder)]
    assert len(numbers) > 100
    assert [list(values) for _, values, meaning in numbers if not meaning] == []


def test_every_folder_of_the_diagnosis_is_in_the_page():
    package = MEASURED.parent
    folders = {path.name for path in package.iterdir() if (path / "__init__.py").exists()}
    assert folders == set(HEADINGS)


def test_the_page_is_up_to_date():
    assert PAGE.read_text(encoding="utf-8") == reference(), "run `make docs`"

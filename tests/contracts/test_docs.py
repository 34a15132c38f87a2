"""docs/contracts.md names every column in its table's section, and every key of a verdict."""

import re
from pathlib import Path

import pytest
from pydantic import BaseModel

from pipelines.contracts import CONTRACTS, verdict
from pipelines.contracts.joints import Joint

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "contracts.md").read_text(encoding="utf-8")
CUFF_FORCES = "{thigh,shank}_{front,back}_force_{x,y,z}_n"


def names_in(section: str) -> set[str]:
    """Return the names in backticks, the cuff forces written out."""
    names = set(re.findall(r"`([^`\n]+)`", section))
    if CUFF_FORCES in names:
        names |= {
            f"{segment}_{side}_force_{axis}_n"
            for segment in ("thigh", "shank")
            for side in ("front", "back")
            for axis in "xyz"
        }
    return names


def section_of(label: str) -> str:
    """Return the text from a table's heading to the next heading."""
    (section,) = re.findall(rf"^## `{label}`.*?(?=^## )", PAGE, re.MULTILINE | re.DOTALL)
    return section


@pytest.mark.parametrize("contract", CONTRACTS, ids=lambda contract: contract.name)
def test_every_column_stands_in_its_tables_section(contract):
    columns = {
        Joint("*").column(column.name) if column.per_joint else column.name
        for column in contract.columns
    }
    assert columns - names_in(section_of(contract.label)) == set()


ROWS = {
    verdict.Finding: r"findings\[\]\.",
    verdict.LikelyCause: r"findings\[\]\.causes",
    verdict.Law: r"findings\[\]\.laws",
    verdict.Node: r"findings\[\]\.path",
    verdict.Shares: "router",
    verdict.Posterior: r"posterior\.",
}
"""The rows that describe an object's keys, by how they begin."""


@pytest.mark.parametrize("model", ROWS, ids=lambda model: model.__name__)
def test_every_key_of_a_decision_stands_in_the_row_of_its_object(model):
    rows = re.findall(rf"^\| `{ROWS[model]}.*$", PAGE, re.MULTILINE)
    keys = {name.rpartition(".")[2] for name in names_in("\n".join(rows))}
    assert set(model.model_fields) - keys == set()


OBJECTS = [
    model
    for model in vars(verdict).values()
    if isinstance(model, type)
    and issubclass(model, BaseModel)
    and model.__module__ == verdict.__name__
]


@pytest.mark.parametrize("model", OBJECTS, ids=lambda model: model.__name__)
def test_every_key_of_a_verdict_stands_in_its_section(model):
    keys = {field.alias or name for name, field in model.model_fields.items()}
    assert keys - set(re.findall(r"\w+", section_of("verdict/1"))) == set()


def test_every_page_stands_in_the_index():
    pages = {path.name for path in DOCS.glob("*.md")} - {"README.md"}
    index = (DOCS / "README.md").read_text(encoding="utf-8")
    assert {page for page in pages if f"({page})" not in index} == set()

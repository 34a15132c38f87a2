"""docs/contracts.md speaks of every table and every column."""

import re
from pathlib import Path

import pytest

from pipelines.contracts import CONTRACTS, verdict
from pipelines.contracts.joints import QUANTITIES

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "contracts.md").read_text(encoding="utf-8")
EXPANDED = (
    PAGE.replace("{thigh,shank}_{front,back}_force_{x,y,z}_n", "cuff")
    + "angle velocity acceleration"
)


@pytest.mark.parametrize("contract", CONTRACTS, ids=lambda contract: contract.name)
def test_every_table_and_column_is_documented(contract):
    assert f"`{contract.label}`" in PAGE
    for column in contract.columns:
        if re.fullmatch(r"(thigh|shank)_(front|back)_force_[xyz]_n", column.name):
            assert "cuff" in EXPANDED
        elif column.per_joint:
            patterns = QUANTITIES[column.name]
            assert patterns.revolute.format(joint="*") in PAGE or column.name in EXPANDED
        else:
            assert f"`{column.name}`" in PAGE


def test_every_page_stands_in_the_index():
    pages = {path.name for path in DOCS.glob("*.md")} - {"README.md"}
    index = (DOCS / "README.md").read_text(encoding="utf-8")
    assert {page for page in pages if f"({page})" not in index} == set()


DECISION = (
    verdict.Finding,
    verdict.Likely,
    verdict.Law,
    verdict.Node,
    verdict.Shares,
    verdict.Posterior,
)


@pytest.mark.parametrize(
    "key",
    sorted(
        {name for model in DECISION for name in model.model_fields}
        | {"findings", "router", "posterior"}
    ),
)
def test_every_key_of_the_decision_is_documented(key):
    assert re.search(rf"`(?:\w+(?:\[\])?\.)?{key}`", PAGE)

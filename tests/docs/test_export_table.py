"""docs/export.md says of every effect what the formats do with it."""

from pathlib import Path

from docs.site.export_table import table


def test_the_page_holds_the_table_that_the_formats_give():
    page = (Path(__file__).parents[2] / "docs" / "export.md").read_text(encoding="utf-8")
    assert table() in page, "run `make docs`"

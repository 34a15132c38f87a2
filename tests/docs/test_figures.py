"""Every figure of a page has a command that makes it, and is shown."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
SHOWN = re.compile(r"!\[[^\]]+\]\((?:docs/)?images/([\w-]+\.png)\)")
COMMAND = re.compile(r"\b(?:make (?:real|blind-page)|python docs/site/\w+\.py|exoid identify)\b")


@pytest.mark.parametrize(
    "page",
    [page for page in PAGES if SHOWN.search(page.read_text(encoding="utf-8"))],
    ids=lambda page: page.name,
)
def test_a_page_with_figures_names_the_command_that_makes_them(page):
    assert COMMAND.search(page.read_text(encoding="utf-8"))


def test_every_picture_is_shown():
    shown = {name for page in PAGES for name in SHOWN.findall(page.read_text(encoding="utf-8"))}
    assert shown == {path.name for path in (ROOT / "docs" / "images").glob("*.png")}

"""Files, make targets, pages and headings that pages name exist."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PATTERNS = ("*.md", "docs/**/*.md", "datasets/**/*.md", "tests/**/README.md")
PAGES = sorted(path for pattern in PATTERNS for path in ROOT.glob(pattern))
IN_CODE = re.compile(r"`((?:pipelines|exoid_cli|tests|docs|datasets)/[\w./-]*)`")
MADE = re.compile(r"`make ([a-z][a-z-]*)`")
LINK = re.compile(r"\]\((?!https?:)([^)#\s]*)(?:#([\w-]+))?\)")
HEADING = re.compile(r"^#+ (.+)$", re.MULTILINE)
TARGETS = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.M))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_files_and_targets_that_a_page_names_exist(page):
    text = page.read_text(encoding="utf-8")
    assert [path for path in IN_CODE.findall(text) if not (ROOT / path).exists()] == []
    assert set(MADE.findall(text)) <= TARGETS


def anchors(page: Path) -> set[str]:
    """Return the anchors of a page's headings, as the site and GitHub make them."""
    headings = HEADING.findall(page.read_text(encoding="utf-8"))
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_pages_and_headings_that_a_page_links_to_exist(page):
    for name, anchor in LINK.findall(page.read_text(encoding="utf-8")):
        target = page.parent / name if name else page
        assert target.exists(), name
        assert not anchor or anchor in anchors(target), f"{name}#{anchor}"

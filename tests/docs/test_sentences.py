"""Sentences of the README and of docs/ have at most 30 words.

Code, formulae, tables and the parts that a program writes do not count.
"""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
MOST_WORDS = 30

GENERATED = {"docs/import-map.md"}
"""Pages that a program writes as a whole, with lists in sentences."""

WRITTEN = re.compile(
    r"^```.*?^```"  # code
    r"|<!-- (?:measured|written).*?<!-- until here -->"  # measured numbers
    r"|<!--.*?-->",
    re.DOTALL | re.MULTILINE,
)
NOT_PROSE = re.compile(r"^(?:    |\s*\||#|!\[|\$\$).*$", re.MULTILINE)
"""Indented code, tables, headings, pictures and formulae."""
BLOCKS = re.compile(r"\n\s*\n|\n(?=\s*(?:[-*]|\d+\.) )")
BULLET = re.compile(r"^\s*(?:[-*>]|\d+\.) +")
ENDS = re.compile(r"(?<!\bet al)[.?!][\"')*]*\s+(?=[\"'(*]*(?:[A-Z0-9`\[]|exoid\b))")


def sentences(page: str) -> Iterator[str]:
    """Yield the sentences of a Markdown page."""
    prose = NOT_PROSE.sub("\n", WRITTEN.sub("\n\n", page))
    for block in BLOCKS.split(prose):
        yield from ENDS.split(" ".join(BULLET.sub("", block).split()))


def words(sentence: str) -> int:
    """Count words; code between backquotes is one word, and a link has the words of its text."""
    plain = re.sub(r"`[^`]*`", "code", sentence)
    plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", plain)
    return sum(any(letter.isalnum() for letter in word) for word in plain.split())


def too_long(page: str) -> list[str]:
    """Return the sentences of a page that have too many words."""
    return [sentence for sentence in sentences(page) if words(sentence) > MOST_WORDS]


def pages() -> Iterator[tuple[str, str]]:
    """Yield name and text of each page that a person writes."""
    for pattern in ("*.md", "docs/*.md", "docs/decisions/*.md", "docs/examples/*.md"):
        for path in sorted(ROOT.glob(pattern)):
            name = path.relative_to(ROOT).as_posix()
            if name not in GENERATED:
                yield name, path.read_text(encoding="utf-8")


LONG = " ".join(["word"] * (MOST_WORDS + 1)).capitalize() + "."


@pytest.mark.parametrize(
    "page",
    [
        LONG,
        f"Short. {LONG}",
        f"- {LONG}",
        f"1. Short.\n2. {LONG}",
        LONG.replace("word", "`a b`", 1),
    ],
)
def test_a_long_sentence_is_seen(page):
    assert too_long(page)


@pytest.mark.parametrize(
    "page",
    [
        LONG.replace("word word", "word. Word", 1),
        LONG.replace("word word", "[word](a-b.md)", 1),
        LONG.replace("word word", "`word word`", 1),
        f"```\n{LONG}\n```",
        f"    {LONG}",
        f"$${LONG}$$",
        f"| {LONG} |",
        f"<!-- measured: a -->\n{LONG}\n<!-- until here -->",
        "\n".join(["- word word"] * MOST_WORDS),
    ],
)
def test_short_sentences_code_tables_and_written_parts_are_not(page):
    assert not too_long(page)


def test_no_page_has_a_long_sentence():
    assert {name: texts for name, page in pages() if (texts := too_long(page))} == {}

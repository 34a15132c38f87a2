"""The pages show the verdict that ``exoid diagnose`` prints."""

import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture
def example(monkeypatch):
    monkeypatch.syspath_prepend(DOCS / "site")
    import example_verdict

    yield example_verdict
    sys.modules.pop("example_verdict")


def test_every_part_that_a_page_asks_for_is_there(example):
    for page in example.PAGES:
        asked = [
            name
            for _, names, _ in example.MARK.findall(page.read_text(encoding="utf-8"))
            for name in names.split()
        ]
        assert asked
        assert set(asked) <= set(example.PARTS)


def test_every_part_of_a_page_begins_as_its_name_says(example):
    """What is printed has changed, or what a part is recognized by."""
    for page in example.PAGES:
        for block, names, _ in example.MARK.findall(page.read_text(encoding="utf-8")):
            _, _, after = page.read_text(encoding="utf-8").partition(block)
            shown = after[: after.index("```")]
            assert set(names.split()) == set(example.paragraphs(shown))


def test_parts_are_recognized_by_their_first_words_and_long_sentences_are_broken(example):
    sentence = "Missing from the simulation: " + "a cause and " * 10
    parts = example.paragraphs(
        f"{sentence.strip()}\n\nis anything missing?   probability\nnothing   0.00\n\nother\n"
    )
    assert set(parts) == {"summary", "missing"}
    assert max(map(len, parts["summary"].splitlines())) <= 80
    assert parts["missing"] == "is anything missing?   probability\nnothing   0.00\n"


def test_a_page_is_filled_alike_twice(example):
    page = "a\n<!-- example_verdict: summary errors -->\n```text\nold\n```\nb\n"
    parts = {"summary": "one\n", "errors": "two\n"}
    once = example.filled(page, parts)
    assert once == "a\n<!-- example_verdict: summary errors -->\n```text\none\n\ntwo\n```\nb\n"
    assert example.filled(once, parts) == once


@pytest.mark.slow
def test_the_pages_show_what_is_printed(example, tmp_path):
    parts = example.paragraphs(example.diagnosed(tmp_path))
    for page in example.PAGES:
        text = page.read_text(encoding="utf-8")
        assert example.filled(text, parts) == text, "run `make docs`"

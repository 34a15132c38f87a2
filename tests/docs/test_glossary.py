"""The words to avoid of docs/glossary.md are in no name, docstring, comment, message or page."""

import ast
import io
import re
import tokenize
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
GLOSSARY = ROOT / "docs" / "glossary.md"
WHOLE_NAMES = {"found", "made", "said", "left"}
"""Words that are plain English in a sentence, and no name for a value."""
SIDES = {"left", "right"}


def words_to_avoid() -> set[str]:
    """Read the words of the glossary's last table."""
    _, table = GLOSSARY.read_text(encoding="utf-8").split("## Words to avoid")
    cells = re.findall(r"^\| ([^|]+) \|", table, flags=re.MULTILINE)[1:]
    cells = [cell.split(" as the name")[0] for cell in cells if not cell.startswith("-")]
    return {word.strip() for cell in cells for word in cell.split(",")}


AVOIDED = words_to_avoid()
IN_NAMES = {word for word in AVOIDED if " " not in word}
IN_TEXTS = AVOIDED - WHOLE_NAMES


def in_name(name: str) -> bool:
    """Return whether a name is, or has as a part, a word to avoid."""
    lower = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name).lower().strip("_")
    return lower in IN_NAMES or any(part in IN_NAMES - WHOLE_NAMES for part in lower.split("_"))


def in_text(text: str) -> list[str]:
    """Return the words to avoid in a sentence."""
    plain = re.sub(r"`[^`]*`|\{[^}]*\}", " ", text.lower())
    words = " ".join(re.findall(r"[a-z]+", plain))
    return [word for word in IN_TEXTS for _ in re.findall(rf"\b{word}\b", words)]


def names_defined(tree: ast.AST) -> Iterator[str]:
    """Yield the names that code defines: functions, classes, arguments, variables, attributes."""
    names = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
    sides = SIDES if names >= SIDES else set()
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            yield node.name
        elif isinstance(node, ast.arg):
            yield node.arg
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            if node.id not in sides:
                yield node.id
        elif isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
            yield node.attr


def texts(source: str) -> Iterator[str]:
    """Yield comments and strings of several words; single words are keys of files."""
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            yield token.string
    tree = ast.parse(source)
    formatted = [node for node in ast.walk(tree) if isinstance(node, ast.JoinedStr)]
    parts = {id(part) for node in formatted for part in node.values}
    for node in ast.walk(tree):
        if not (isinstance(node, ast.Constant) and isinstance(node.value, str)):
            continue
        if " " in node.value.strip() or id(node) in parts:
            yield node.value


def avoided_in(source: str) -> list[str]:
    """Return the words to avoid in the names and texts of a module."""
    names = [name for name in names_defined(ast.parse(source)) if in_name(name)]
    return names + [word for text in texts(source) for word in in_text(text)]


def avoided_by_file() -> Iterator[tuple[str, list[str]]]:
    """Yield each module and page with its words to avoid."""
    for root in ("pipelines", "exoid_cli", "docs"):
        for path in (ROOT / root).rglob("*.py"):
            words = avoided_in(path.read_text(encoding="utf-8"))
            words += [path.stem] * in_name(path.stem)
            yield path.relative_to(ROOT).as_posix(), words
    assets = ROOT / "pipelines" / "report" / "assets"
    pages = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md"), *assets.glob("*.html")]
    for path in (*pages, assets / "page.js"):
        if path != GLOSSARY:
            text = re.sub(r"```.*?```", " ", path.read_text(encoding="utf-8"), flags=re.DOTALL)
            yield path.relative_to(ROOT).as_posix(), in_text(text)


@pytest.mark.parametrize(
    "source",
    [
        "told = 1",
        "def f(what_was_told): ...",
        "class Heard: ...",
        "self.found = 3",
        "x = 1  # nought",
        'raise ValueError("a nought beside it")',
        'text = f"{x} told {y}"',
        "class WhatWasTold: ...",
    ],
)
def test_a_word_to_avoid_is_seen(source):
    assert avoided_in(source)


@pytest.mark.parametrize(
    "source",
    ["residual = 1", 'key = "told"', "left, right = 1, 2", 'x = "found 3, expected 4"'],
)
def test_other_words_and_keys_of_files_are_not(source):
    assert not avoided_in(source)


def test_no_module_or_page_holds_a_word_to_avoid():
    assert {file: words for file, words in avoided_by_file() if words} == {}


def test_no_class_is_named_by_a_participle_alone():
    """``Exported`` says what happens to a thing, and not what it is; an error is an event."""
    classes = {
        node.name: {base.id for base in node.bases if isinstance(base, ast.Name)}
        for root in ("pipelines", "exoid_cli")
        for path in (ROOT / root).rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.ClassDef)
    }
    events = {"DeviceError", "KeyboardInterrupt"}
    participles = {name for name in classes if re.fullmatch(r"_?[A-Z][a-z]+ed", name)}
    assert {name for name in participles if not classes[name] & events} == set()

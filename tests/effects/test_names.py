"""No other package names an effect: each effect declares what other packages need of it."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from pipelines import effects
from pipelines.effects import EFFECTS, baseline
from pipelines.effects.baseline import ForceSensorZero

ROOT = Path(effects.__file__).parents[2]
FOLDERS = ("exoid_cli", "pipelines")
OWN = Path(effects.__file__).parent

CLASSES = {effect for effect in (*EFFECTS, ForceSensorZero) if effect.__module__.startswith("pip")}
NAMES = {effect.name for effect in CLASSES}
MODULES = {effect.__module__ for effect in CLASSES}

STEP = "friction is the name of a step in parameters/1 too"
EXAMPLE = "an example in the help of an option or a setting"
EXCEPTIONS = {
    ("pipelines/contracts/parameters.py", "friction"): STEP,
    ("pipelines/contracts/parameters.py", "rigid_body"): "the names that the file has",
    ("pipelines/diagnosis/fit/parameter_rows.py", "friction"): STEP,
    ("pipelines/identification/parameter_rows.py", "friction"): STEP,
    ("exoid_cli/diagnose.py", "rotor_inertia"): EXAMPLE,
    ("exoid_cli/identify.py", "rotor_inertia"): EXAMPLE,
    ("pipelines/settings/diagnose.py", "rotor_inertia"): EXAMPLE,
}
"""Reasons by file and name. The classes in ``pipelines.effects.baseline`` are exceptions as well:
every model starts with them."""


def test_no_other_package_names_an_effect():
    named = {
        (path.relative_to(ROOT).as_posix(), name)
        for folder in FOLDERS
        for path in (ROOT / folder).rglob("*.py")
        if OWN not in path.parents
        for name in named_in(path.read_text(encoding="utf-8"))
    }
    assert named == set(EXCEPTIONS)


def test_no_template_names_an_effect():
    words = {
        word
        for path in (ROOT / "pipelines").rglob("*.html")
        for word in re.findall(r"\w+", path.read_text(encoding="utf-8"))
    }
    # Friction is a word of the page's text too.
    assert words & NAMES == {"friction"}


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ('SPRINGS = ("parallel_spring", "inertia")', {"parallel_spring"}),
        ('label = "backlash@knee"', {"backlash"}),
        ('text = f"{count} times torque_gain"', {"torque_gain"}),
        ('"""A page about torque_gain, not about backlash."""', set()),
        ("from pipelines.effects import Backlash, Effect", {"Backlash"}),
        ("from pipelines.effects.backlash import SHAFT_STIFFNESS", {"pipelines.effects.backlash"}),
        ("import pipelines.effects.backlash", {"pipelines.effects.backlash"}),
        ("from pipelines.effects.baseline import Friction", set()),
        ("from pipelines.effects import Friction", {"Friction"}),
    ],
)
def test_strings_and_imports_that_name_an_effect_are_seen(source, expected):
    assert set(named_in(source)) == expected


def named_in(source: str) -> Iterator[str]:
    """Yield names, classes and modules of effects in strings and imports, docstrings aside."""
    tree = ast.parse(source)
    docstrings = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module and node.module != baseline.__name__:
            imported = {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
            yield from imported & MODULES
            if node.module == effects.__name__:
                classes = {effect.__name__ for effect in CLASSES}
                yield from classes & {alias.name for alias in node.names}
        elif isinstance(node, ast.Import):
            yield from MODULES & {alias.name for alias in node.names}
        elif isinstance(node, ast.Constant) and id(node) not in docstrings:
            yield from _in_text(node.value) if isinstance(node.value, str) else ()


def _in_text(text: str) -> Iterator[str]:
    for name in NAMES:
        # Names of one word, such as backlash, are words of messages too.
        anywhere = "_" in name and re.search(rf"\b{name}\b", text)
        if anywhere or text == name or text.startswith(f"{name}@"):
            yield name


def test_each_pair_of_tied_effects_is_listed_once_and_exists():
    pairs = [frozenset({effect.name, other}) for effect in EFFECTS for other in effect.ties]
    assert len(pairs) == len(set(pairs)) > 10
    assert set().union(*pairs) <= NAMES


def test_each_element_of_a_model_format_is_one_effect():
    elements = [effect.element for effect in EFFECTS if effect.element]
    assert len(elements) == len(set(elements)) == len(type(elements[0]))

"""The syntax of formulae and branches in a programming language."""

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from enum import IntEnum
from importlib.resources import files
from string import Template
from typing import Any

from pipelines.errors import InputError
from pipelines.export.formula import Branch, Formula


class Precedence(IntEnum):
    """How tightly an operator binds, the loosest first."""

    SUM = 0
    PRODUCT = 1
    SIGN = 2
    POWER = 3
    ATOM = 4


@dataclass(frozen=True)
class Language:
    """The differences between the languages of exported equations."""

    names: Mapping[str, str]
    """Names of functions that differ from those of ``formula.FUNCTIONS``."""
    element: Callable[[str, int], str]
    """Returns an element of an array, counted from 0."""
    power: Callable[[str, str], str]
    """Returns a power; both operands have brackets if needed."""
    unequal: str
    branch: Callable[[str, list[str], list[str]], list[str]]
    """Returns the lines of a branch, from its condition and both lists of statements."""

    def text(self, formula: Any, at_least: int = Precedence.SUM) -> str:
        """Return a formula or a number as code.

        Parameters
        ----------
        formula : Formula or float
            The expression.
        at_least : int, optional
            Precedence below which it gets brackets.
        """
        text, precedence = self._text_and_precedence(formula)
        return f"({text})" if precedence < at_least else text

    def _text_and_precedence(self, formula: Any) -> tuple[str, int]:
        if not isinstance(formula, Formula):
            # A negative number is a negation: as the base of a power it needs brackets.
            return repr(float(formula)), Precedence.SIGN if formula < 0 else Precedence.ATOM
        operator, operands = formula.operator, formula.operands
        if operator == "constant":
            return self.names.get(operands[0], operands[0]), Precedence.ATOM
        if operator == "element":
            return self.element(*operands), Precedence.ATOM
        if operator in ("+", "-", "*", "/"):
            precedence = Precedence.SUM if operator in "+-" else Precedence.PRODUCT
            # Differences and quotients associate to the left, so that an equal operator at the
            # right needs brackets.
            right = self.text(operands[1], precedence + (operator in "-/"))
            return f"{self.text(operands[0], precedence)} {operator} {right}", precedence
        if operator == "neg":
            return f"-{self.text(operands[0], Precedence.POWER)}", Precedence.SIGN
        if operator == "**":
            # Brackets around both operands: MATLAB's ^ associates to the left, Python's ** to the
            # right.
            both = (self.text(operand, Precedence.ATOM) for operand in operands)
            return self.power(*both), Precedence.POWER
        called = self.names.get(operator, operator)
        return f"{called}({', '.join(map(self.text, operands))})", Precedence.ATOM

    def added(self, outcome: list | Branch, to: str) -> list[str]:
        """Return the statements that add a kernel's outcome to an array, without zeros.

        Parameters
        ----------
        outcome : list or Branch
            A formula or number by element.
        to : str
            Name of the array.
        """

        def addition(i: int, value: Any) -> list[str]:
            if not isinstance(value, Formula) and value == 0:
                return []
            target = self.element(to, i)
            return [f"{target} = {target} + {self.text(value)};"]

        return self._statements(outcome, addition)

    def assigned(self, outcome: list | Branch, to: str, first: int = 0) -> list[str]:
        """Return the statements that assign a kernel's outcome to an array.

        Parameters
        ----------
        outcome : list or Branch
            A formula or number by element.
        to : str
            Name of the array.
        first : int, optional
            Index of its first element.
        """

        def assignment(i: int, value: Any) -> list[str]:
            target, text = self.element(to, first + i), self.text(value)
            # A sensor leaves most torques unchanged.
            return [] if text == target else [f"{target} = {text};"]

        return self._statements(outcome, assignment)

    def _statements(
        self, outcome: list | Branch, statement: Callable[[int, Any], list[str]]
    ) -> list[str]:
        if isinstance(outcome, Branch):
            yes = self._statements(outcome.yes, statement)
            no = self._statements(outcome.no, statement)
            condition = outcome.condition
            sign = self.unequal if condition.operator == "!=" else condition.operator
            compared = f"{self.text(condition.left)} {sign} {self.text(condition.right)}"
            return self.branch(compared, yes, no) if yes or no else []
        return [line for i, value in enumerate(outcome) for line in statement(i, value)]


def filled(template: str, places: Mapping[str, Any]) -> str:
    """Return the text of a file in ``templates`` with its places filled.

    Parameters
    ----------
    template : str
        Name of the file.
    places : dict
        Text of each ``${place}`` by its name.
    """
    file = files("pipelines.export") / "templates" / template
    return Template(file.read_text(encoding="utf-8")).substitute(places)


def indented(lines: Iterable[str]) -> list[str]:
    """Return lines of code one level deeper."""
    return [f"    {line}" for line in lines]


def identifier(text: str) -> str:
    """Return a name of ASCII letters, digits and underscores that starts with a letter."""
    name = re.sub(r"[^A-Za-z0-9]+", "_", text).strip("_")
    return name if name[:1].isalpha() else f"x{name}"


def function_name(stem: str, suffix: str, keywords: Iterable[str] = ()) -> str:
    """Return the name of a file's functions, which is the file's stem.

    Raises
    ------
    InputError
        If it is no name in the language.
    """
    if stem != identifier(stem) or stem in keywords:
        raise InputError(
            f"{one_line(stem)}{suffix}: its functions have the file's name, expected ASCII letters,"
            " digits and single underscores, a letter first, and no keyword. Name the file with -o"
        )
    return stem


def unique(names: Iterable[str], taken: Iterable[str] = ()) -> list[str]:
    """Return the names, with a number after each repeated one; none is empty."""
    used = set(taken)
    results = []
    for name in names:
        base = name or "unnamed"
        candidate, number = base, 1
        while candidate in used:
            number += 1
            candidate = f"{base}_{number}"
        used.add(candidate)
        results.append(candidate)
    return results


def one_line(text: str) -> str:
    """Return text with escapes for line breaks and control characters."""
    return "".join(c if c.isprintable() else f"\\u{ord(c):04x}" for c in text)

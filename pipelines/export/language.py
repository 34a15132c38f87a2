"""How a programming language spells a formula, a choice and a comment."""

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from pipelines.errors import InputError
from pipelines.export.formula import Branch, Condition, Formula

SUM, PRODUCT, SIGN, POWER, ATOM = range(5)
"""What binds how tightly."""

BINARY = {"+": SUM, "-": SUM, "*": PRODUCT, "/": PRODUCT}


@dataclass(frozen=True)
class Language:
    """What differs between the languages that equations are written in."""

    names: Mapping[str, str]
    """Of functions where they are not those of ``formula.FUNCTIONS``."""
    element: Callable[[str, int], str]
    """An element of an array, counted from 0."""
    power: Callable[[str, str], str]
    """A power, both operands in brackets where they need some."""
    unequal: str
    choice: Callable[[str, list[str], list[str]], list[str]]
    """The lines of a choice: condition, statements either way."""

    def text(self, formula: Any, at_least: int = SUM) -> str:
        """Write a formula or a number, in brackets where it binds less tightly than asked for."""
        written, binds = self._written(formula)
        return f"({written})" if binds < at_least else written

    def _written(self, formula: Any) -> tuple[str, int]:
        if not isinstance(formula, Formula):
            return repr(float(formula)), SIGN if formula < 0 else ATOM
        operator, operands = formula.operator, formula.operands
        if operator == "constant":
            return self.names.get(operands[0], operands[0]), ATOM
        if operator == "element":
            return self.element(*operands), ATOM
        if operator in BINARY:
            binds = BINARY[operator]
            right = self.text(operands[1], binds + (operator in "-/"))
            return f"{self.text(operands[0], binds)} {operator} {right}", binds
        if operator == "neg":
            return f"-{self.text(operands[0], POWER)}", SIGN
        if operator == "**":
            return self.power(*(self.text(operand, ATOM) for operand in operands)), POWER
        return f"{self.names.get(operator, operator)}({', '.join(map(self.text, operands))})", ATOM

    def added(self, outcome: list | Branch, to: str) -> list[str]:
        """Return the statements that add what a kernel computed to an array, leaving out what is
        nought."""
        return self._statements(
            outcome, lambda i, value: self._addition(self.element(to, i), value)
        )

    def assigned(self, outcome: list | Branch, to: str, first: int = 0) -> list[str]:
        """Return the statements that set an array, from its element ``first`` on, to what a kernel
        computed."""
        return self._statements(
            outcome, lambda i, value: self._assignment(self.element(to, first + i), value)
        )

    def _statements(
        self, outcome: list | Branch, statement: Callable[[int, Any], list[str]]
    ) -> list[str]:
        if isinstance(outcome, Branch):
            ways = [self._statements(way, statement) for way in (outcome.yes, outcome.no)]
            return self.choice(self._question(outcome.condition), *ways) if any(ways) else []
        return [line for i, value in enumerate(outcome) for line in statement(i, value)]

    def _addition(self, target: str, value: Any) -> list[str]:
        if not isinstance(value, Formula) and value == 0:
            return []
        return [f"{target} = {target} + {self.text(value)};"]

    def _assignment(self, target: str, value: Any) -> list[str]:
        # What a sensor leaves alone is not worth a line.
        return [] if self.text(value) == target else [f"{target} = {self.text(value)};"]

    def _question(self, condition: Condition) -> str:
        operator = self.unequal if condition.operator == "!=" else condition.operator
        return f"{self.text(condition.left)} {operator} {self.text(condition.right)}"


def identifier(text: str) -> str:
    """Return a name that every language takes: letters, digits and underscores of ASCII, a letter
    first."""
    name = re.sub(r"[^A-Za-z0-9]+", "_", text).strip("_")
    return name if name[:1].isalpha() else f"x{name}"


def function_name(stem: str, suffix: str, keywords: Iterable[str] = ()) -> str:
    """Return the name of a file's functions, which is the file's.

    Raises
    ------
    InputError
        Where it is no name.
    """
    if stem != identifier(stem) or stem in keywords:
        raise InputError(
            f"{one_line(stem)}{suffix}: its functions are called as the file is, expected letters"
            " and digits of ASCII and single underscores, a letter first, and no word of the"
            " language; name it by -o"
        )
    return stem


def unique(names: Iterable[str], taken: Iterable[str] = ()) -> list[str]:
    """Return the names, a number behind each that was there before; none is empty."""
    known, names_made = set(taken), []
    for name in names:
        base, number, chosen = name or "unnamed", 1, name or "unnamed"
        while chosen in known:
            number += 1
            chosen = f"{base}_{number}"
        known.add(chosen)
        names_made.append(chosen)
    return names_made


def one_line(text: str) -> str:
    """Return text whose every character can be seen: no line breaks, no control characters."""
    return "".join(c if c.isprintable() else f"\\u{ord(c):04x}" for c in text)

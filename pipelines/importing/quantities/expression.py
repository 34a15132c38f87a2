"""Arithmetic with columns, as a map may write it: ``gtau * vir``, ```pos 2` - `pos 1```."""

import ast
import operator
import re
import sys
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipelines.errors import SettingsError

# Arithmetic only. A map may come from others, so that no call or attribute may be evaluated.
OPERATORS: dict[type, Callable] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.UAdd: operator.pos,
    ast.USub: operator.neg,
}


class Expression:
    """Numbers and columns with + - * / and parentheses; backquotes hold other names."""

    def __init__(self, text: str, where: str) -> None:
        self._text, self._where = text, where
        self._quoted: list[str] = []
        try:
            # Names in backquotes become identifiers first: the parser refuses blanks in names.
            plain = re.sub(r"`([^`]*)`", self._placeholder, text).strip()
            self._tree = ast.parse(plain, mode="eval").body
        # The parser raises each of these, depending on the text.
        except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
            raise self._refusal() from error
        self._check(self._tree)

    @property
    def names(self) -> tuple[str, ...]:
        """Its columns, each once."""
        names = (self._name(node) for node in ast.walk(self._tree) if isinstance(node, ast.Name))
        return tuple(dict.fromkeys(names))

    def __call__(self, columns: Mapping[str, NDArray]) -> NDArray:
        """Return the value, (n,) float64; a column of one row counts as a constant."""
        # No warning at a zero denominator: values that are not finite are counted and reported
        # later.
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(self._value(self._tree, columns), dtype=float)

    def _placeholder(self, match: re.Match) -> str:
        self._quoted.append(match[1])
        return f"_quoted_{len(self._quoted) - 1}"

    def _name(self, node: ast.Name) -> str:
        quoted = re.fullmatch(r"_quoted_(\d+)", node.id)
        return self._quoted[int(quoted[1])] if quoted else node.id

    def _value(self, node: Any, columns: Mapping[str, NDArray]) -> Any:
        match node:
            case ast.BinOp():
                return OPERATORS[type(node.op)](
                    self._value(node.left, columns), self._value(node.right, columns)
                )
            case ast.UnaryOp():
                return OPERATORS[type(node.op)](self._value(node.operand, columns))
            case ast.Name():
                return columns[self._name(node)]
            case _:
                return float(node.value)

    def _check(self, tree: ast.expr) -> None:
        # In one expression; nobody could check a longer one.
        most_operations = 100
        for node in ast.walk(tree):
            number = isinstance(node, ast.Constant) and _is_number(node.value)
            known = (
                isinstance(node, ast.BinOp | ast.UnaryOp | ast.Name | ast.Load)
                or type(node) in OPERATORS
            )
            if not (number or known) or (hasattr(node, "op") and type(node.op) not in OPERATORS):
                raise self._refusal()
        if sum(hasattr(node, "op") for node in ast.walk(tree)) > most_operations:
            raise self._refusal(
                f", at most {most_operations} operations; compute a column of its own instead"
            )
        if not self.names:
            raise self._refusal(", one column at least")

    def _refusal(self, more: str = "") -> SettingsError:
        text = self._text if len(self._text) <= 60 else f"{self._text[:57]}..."
        return SettingsError(
            f"{self._where}: found {text!r}, expected numbers and columns with + - * / ( ), names"
            f" with blanks or signs in `backquotes`{more}"
        )


def _is_number(value: Any) -> bool:
    # By type, as True is an int, too. Above the largest are infinity and integers that overflow.
    return type(value) in (int, float) and value <= sys.float_info.max

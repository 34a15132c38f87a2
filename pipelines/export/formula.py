"""Formulae of kernels, traced by calling them with symbols instead of numbers.

Kernels are plain scalar Python before numba compiles them. Called with `Formula` objects they
return formulae, which a format prints in its own language. An exported file therefore has the same
equations as every stage, without a second copy of them.
"""

import math
import operator
from collections.abc import Callable, Iterator, Mapping
from contextvars import ContextVar
from dataclasses import dataclass
from types import FunctionType, SimpleNamespace
from typing import Any

from pipelines.errors import ExoidError

FUNCTIONS: dict[str, Callable[..., Any]] = {
    **{
        name: getattr(math, name)
        for name in ("sin", "cos", "tan", "exp", "expm1", "log", "sqrt", "tanh", "atan", "atan2")
    },
    "abs": abs,
    "max": max,
    "min": min,
    "sign": lambda x: (x > 0) - (x < 0),
}
"""Functions that an equation may call, and that every format can write."""


class NotWritable(ExoidError):
    """A kernel that no formula can express, such as one that reads its own past."""


@dataclass(frozen=True, eq=False)
class Formula:
    """A number that the exported file computes.

    ``operator`` is one of + - * / ** neg, a function's name, ``element`` (of an array) or
    ``constant``.
    """

    operator: str
    operands: tuple[Any, ...]
    value: float | None = None
    """Value of a constant; comparisons of constants are evaluated while tracing."""

    def __add__(self, other):
        return _sum(self, other)

    def __radd__(self, other):
        return _sum(other, self)

    def __sub__(self, other):
        # Sums and products with 0 and 1 are simplified while tracing, or files would be full of
        # vanishing terms.
        return self if _is(other, 0) else Formula("-", (self, other))

    def __rsub__(self, other):
        return -self if _is(other, 0) else Formula("-", (other, self))

    def __mul__(self, other):
        return _product(self, other)

    def __rmul__(self, other):
        return _product(other, self)

    def __truediv__(self, other):
        return Formula("/", (self, other))

    def __rtruediv__(self, other):
        return 0.0 if _is(other, 0) else Formula("/", (other, self))

    def __pow__(self, other):
        return Formula("**", (self, other))

    def __rpow__(self, other):
        return Formula("**", (other, self))

    def __neg__(self):
        return Formula("neg", (self,))

    def __abs__(self):
        return Formula("abs", (self,))

    def __lt__(self, other):
        return _compare("<", self, other)

    def __le__(self, other):
        return _compare("<=", self, other)

    def __gt__(self, other):
        return _compare(">", self, other)

    def __ge__(self, other):
        return _compare(">=", self, other)

    def __eq__(self, other):
        return _compare("==", self, other)

    def __ne__(self, other):
        return _compare("!=", self, other)

    # Comparing formulae makes a condition, so none can be the key of a dictionary.
    __hash__ = None  # type: ignore[assignment]

    def __bool__(self):
        """Refuse to be a condition."""
        raise NotWritable("it uses a number as a condition")


def constant(name: str, value: float) -> Formula:
    """Return a constant that the equation refers to by name."""
    return Formula("constant", (name,), float(value))


def names_in(outcome: Any, kind: str) -> Iterator[str]:
    """Yield the name of each ``constant``, or of the array of each ``element``, of an outcome."""
    match outcome:
        case Branch(condition, yes, no):
            yield from names_in([condition.left, condition.right, yes, no], kind)
        case list() | tuple():
            for part in outcome:
                yield from names_in(part, kind)
        case Formula() if outcome.operator == kind:
            yield outcome.operands[0]
        case Formula():
            yield from names_in(outcome.operands, kind)


@dataclass(frozen=True)
class Elements:
    """An array such as ``q`` whose elements are formulae."""

    name: str
    length: int

    def __getitem__(self, index: int) -> Formula:
        """Return an element."""
        if not -self.length <= index < self.length:
            raise IndexError(index)
        return Formula("element", (self.name, index % self.length))

    def __iter__(self) -> Iterator[Formula]:
        """Iterate over the elements."""
        return (self[i] for i in range(self.length))

    @property
    def shape(self) -> tuple[int]:
        """Shape, as of a numpy array."""
        return (self.length,)


@dataclass(frozen=True)
class Condition:
    """A comparison that only the exported program can evaluate."""

    operator: str
    left: Any
    right: Any

    def __bool__(self) -> bool:
        """Return the value on the current path; without one, stop at the fork."""
        choices = _CHOICES.get()
        # By its text, because each pass through the kernel makes the same comparison a new object.
        key = repr(self)
        if key not in choices:
            raise _Fork(self, key)
        return choices[key]


@dataclass(frozen=True)
class Branch:
    """The outcomes of a condition."""

    condition: Condition
    yes: Any
    no: Any


class _Fork(Exception):
    def __init__(self, condition: Condition, key: str):
        self.condition, self.key = condition, key


_CHOICES: ContextVar[Mapping[str, bool]] = ContextVar("choices")
"""Values of the conditions on the current path, by condition."""


def outcome_of(kernel, arguments: Callable[[], tuple[tuple, list]]) -> Any:
    """Return the outcome of a compiled kernel as formulae.

    Parameters
    ----------
    kernel : numba dispatcher
        Of the kinds in ``pipelines.effects.kernel``.
    arguments : callable
        Returns the kernel's arguments and, among them, the list that it writes to; called once per
        path through the kernel.

    Returns
    -------
    list, or Branch of such
        Numbers and formulae that the kernel writes to the list.

    Raises
    ------
    NotWritable
        If no formula can express the kernel.
    """
    # Most paths through one kernel.
    most_branches = 64
    function = _plain(kernel.py_func, {})
    paths = 0

    # The kernel runs again with both values of each condition that it meets, until no path has an
    # open one.
    def walk(choices: dict[str, bool]):
        nonlocal paths
        paths += 1
        if paths > most_branches:
            raise NotWritable(f"it has more than {most_branches} paths")
        inputs, out = arguments()
        try:
            _CHOICES.set(choices)
            function(*inputs)
        except _Fork as fork:
            yes, no = (walk(choices | {fork.key: choice}) for choice in (True, False))
            return Branch(fork.condition, yes, no)
        except (TypeError, AttributeError, IndexError, ValueError) as error:
            raise NotWritable(f"its equation cannot be written as a formula ({error})") from error
        return out

    return walk({})


def _plain(function: FunctionType, done: dict[FunctionType, FunctionType]) -> FunctionType:
    """Return an uncompiled function that calls uncompiled functions, and accepts formulae."""
    if function not in done:
        # The same code with other globals, in which kernels are uncompiled and math accepts
        # formulae.
        scope: dict[str, Any] = {}
        plain = FunctionType(
            function.__code__, scope, function.__name__, function.__defaults__, function.__closure__
        )
        # Registered before its globals are replaced, so that kernels may call each other in a
        # circle.
        done[function] = plain
        known = function.__globals__
        scope |= {
            name: _substitute(known[name], done)
            for name in function.__code__.co_names
            if name in known
        }
        scope |= {name: SUBSTITUTES[name] for name in ("abs", "max", "min") if name not in known}
    return done[function]


def _substitute(thing: Any, done: dict[FunctionType, FunctionType]) -> Any:
    if hasattr(thing, "py_func"):
        return _plain(thing.py_func, done)
    if getattr(thing, "__name__", "") in ("math", "numpy"):
        return SimpleNamespace(pi=math.pi, **SUBSTITUTES)
    name = getattr(thing, "__name__", "")
    if callable(thing) and getattr(math, name, None) is thing:
        if name not in SUBSTITUTES:
            raise NotWritable(f"it calls {name}, which exoid cannot write in other languages")
        return SUBSTITUTES[name]
    return thing


def _function(name: str) -> Callable[..., Any]:
    def call(*arguments):
        if any(isinstance(argument, Formula) for argument in arguments):
            return Formula(name, arguments)
        return float(FUNCTIONS[name](*arguments))

    return call


SUBSTITUTES = {name: _function(name) for name in FUNCTIONS} | {"fabs": _function("abs")}


def _is(operand: Any, number: float) -> bool:
    return not isinstance(operand, Formula) and operand == number


def _sum(a: Any, b: Any) -> Any:
    if _is(a, 0):
        return b
    if _is(b, 0):
        return a
    if isinstance(b, Formula) and b.operator == "neg":
        return Formula("-", (a, b.operands[0]))
    return Formula("+", (a, b))


def _product(a: Any, b: Any) -> Any:
    if _is(a, 0) or _is(b, 0):
        return 0.0
    if _is(a, 1):
        return b
    if _is(b, 1):
        return a
    return Formula("*", (a, b))


def _compare(sign: str, a: Any, b: Any) -> Condition | bool:
    one, other = (side.value if isinstance(side, Formula) else float(side) for side in (a, b))
    # Two known values are compared now: constants of the file never take the other branch.
    if one is None or other is None:
        return Condition(sign, a, b)
    compared = {
        "<": operator.lt,
        "<=": operator.le,
        ">": operator.gt,
        ">=": operator.ge,
        "==": operator.eq,
        "!=": operator.ne,
    }
    return bool(compared[sign](one, other))

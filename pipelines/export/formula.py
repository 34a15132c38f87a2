"""An equation as it is written down: what a kernel computes, told by running it on numbers that are
not yet known.

Kernels are plain scalar Python before numba compiles them. Called with `Formula` objects instead of
numbers they return formulae, which a format prints in its own language. So an exported file holds
the very equations that every stage uses, and no second copy of them stands anywhere.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from types import FunctionType, SimpleNamespace
from typing import Any

from pipelines.errors import ExoidError

FUNCTIONS = (
    "sin",
    "cos",
    "tan",
    "exp",
    "expm1",
    "log",
    "sqrt",
    "tanh",
    "atan",
    "atan2",
    "abs",
    "sign",
    "max",
    "min",
)
"""What an equation may call; every format knows how to spell them."""

MOST_BRANCHES = 64
"""Ways through one kernel beyond which it is no formula any more."""


class NotWritable(ExoidError):
    """A kernel does what no formula can say, such as looking back into its own past."""


@dataclass(frozen=True, eq=False)
class Formula:
    """A number that is computed later.

    ``operator`` is one of + - * / ** neg, a function's name, ``element`` (of an array) or
    ``constant``.
    """

    operator: str
    operands: tuple[Any, ...]
    value: float | None = None
    """What a constant is; comparisons of constants are decided when the formula is written."""

    def __add__(self, other):
        """Write a sum."""
        return _sum(self, other)

    def __radd__(self, other):
        """Write a sum."""
        return _sum(other, self)

    def __sub__(self, other):
        """Write a difference."""
        return self if _is(other, 0) else Formula("-", (self, other))

    def __rsub__(self, other):
        """Write a difference."""
        return -self if _is(other, 0) else Formula("-", (other, self))

    def __mul__(self, other):
        """Write a product."""
        return _product(self, other)

    def __rmul__(self, other):
        """Write a product."""
        return _product(other, self)

    def __truediv__(self, other):
        """Write a quotient."""
        return Formula("/", (self, other))

    def __rtruediv__(self, other):
        """Write a quotient."""
        return 0.0 if _is(other, 0) else Formula("/", (other, self))

    def __pow__(self, other):
        """Write a power."""
        return Formula("**", (self, other))

    def __rpow__(self, other):
        """Write a power."""
        return Formula("**", (other, self))

    def __neg__(self):
        """Write the opposite."""
        return Formula("neg", (self,))

    def __abs__(self):
        """Write the absolute value."""
        return Formula("abs", (self,))

    def __lt__(self, other):
        """Ask which is less."""
        return _compare("<", self, other)

    def __le__(self, other):
        """Ask which is less."""
        return _compare("<=", self, other)

    def __gt__(self, other):
        """Ask which is greater."""
        return _compare(">", self, other)

    def __ge__(self, other):
        """Ask which is greater."""
        return _compare(">=", self, other)

    def __eq__(self, other):
        """Ask whether they are equal."""
        return _compare("==", self, other)

    def __ne__(self, other):
        """Ask whether they differ."""
        return _compare("!=", self, other)

    __hash__ = None  # type: ignore[assignment]

    def __bool__(self):
        """Refuse: a formula is no truth."""
        raise NotWritable("it takes a number for a truth")


def constant(name: str, value: float) -> Formula:
    """Return a constant that the written equation calls by its name."""
    return Formula("constant", (name,), float(value))


def constants_in(outcome: Any) -> Iterator[str]:
    """Yield the names of the constants of an outcome, as often as they stand there."""
    match outcome:
        case Branch(condition, yes, no):
            yield from constants_in([condition.left, condition.right, yes, no])
        case list():
            for part in outcome:
                yield from constants_in(part)
        case Formula(operator="constant"):
            yield outcome.operands[0]
        case Formula():
            yield from constants_in(list(outcome.operands))


def arrays_in(outcome: Any) -> Iterator[str]:
    """Yield the names of the arrays of which an outcome has elements, as often as they stand
    there."""
    match outcome:
        case Branch(condition, yes, no):
            yield from arrays_in([condition.left, condition.right, yes, no])
        case list():
            for part in outcome:
                yield from arrays_in(part)
        case Formula(operator="element"):
            yield outcome.operands[0]
        case Formula():
            yield from arrays_in(list(outcome.operands))


@dataclass(frozen=True)
class Elements:
    """An array that is filled later, such as ``q``: its elements are formulae."""

    name: str
    length: int

    def __getitem__(self, index: int) -> Formula:
        """Return an element."""
        if not -self.length <= index < self.length:
            raise IndexError(index)
        return Formula("element", (self.name, index % self.length))

    def __iter__(self) -> Iterator[Formula]:
        """Go through the elements."""
        return (self[i] for i in range(self.length))

    @property
    def shape(self) -> tuple[int]:
        """As of a numpy array."""
        return (self.length,)


@dataclass(frozen=True)
class Condition:
    """A question that only the running program can answer."""

    operator: str
    left: Any
    right: Any

    def __bool__(self) -> bool:
        """Return the answer of the way that is being gone; where there is none yet, stop at the
        fork."""
        answers = _ANSWERS.get()
        key = repr(self)
        if key not in answers:
            raise _Fork(self, key)
        return answers[key]


@dataclass(frozen=True)
class Branch:
    """What is computed either way."""

    condition: Condition
    yes: Any
    no: Any


class _Fork(Exception):
    def __init__(self, condition: Condition, key: str):
        self.condition, self.key = condition, key


_ANSWERS: ContextVar[Mapping[str, bool]] = ContextVar("answers")


@contextmanager
def _answering(answers: Mapping[str, bool]) -> Iterator[None]:
    token = _ANSWERS.set(answers)
    try:
        yield
    finally:
        _ANSWERS.reset(token)


def written(kernel, arguments: Callable[[], tuple[tuple, list]]) -> Any:
    """Return what a compiled kernel computes, as formulae.

    Parameters
    ----------
    kernel : numba dispatcher
        Of the kinds in ``pipelines.effects.kernel``.
    arguments : callable
        Returns the kernel's arguments and, among them, the list that it writes to; called anew for
        each way through the kernel.

    Returns
    -------
    list, or Branch of such
        What stands in the list afterwards: numbers and formulae.

    Raises
    ------
    NotWritable
        Where the kernel does what no formula can say.
    """
    function = _plain(kernel.py_func, {})
    ways = 0

    def walk(answers: dict[str, bool]):
        nonlocal ways
        ways += 1
        if ways > MOST_BRANCHES:
            raise NotWritable(f"it branches more than {MOST_BRANCHES} ways")
        given, out = arguments()
        try:
            with _answering(answers):
                function(*given)
        except _Fork as fork:
            ahead = [walk(answers | {fork.key: answer}) for answer in (True, False)]
            return Branch(fork.condition, *ahead)
        except (TypeError, AttributeError, IndexError, ValueError) as error:
            raise NotWritable(f"its equation cannot be written as a formula ({error})") from error
        return out

    return walk({})


def _plain(function: FunctionType, done: dict[FunctionType, FunctionType]) -> FunctionType:
    """Return an uncompiled function that calls uncompiled functions, and formulae where it would
    call math."""
    if function not in done:
        scope: dict[str, Any] = {}
        plain = FunctionType(
            function.__code__, scope, function.__name__, function.__defaults__, function.__closure__
        )
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
    of_numbers: dict[str, Callable[..., Any]] = {
        "abs": abs,
        "max": max,
        "min": min,
        "sign": lambda x: (x > 0) - (x < 0),
    }
    at_once = of_numbers[name] if name in of_numbers else getattr(math, name)

    def call(*arguments):
        if any(isinstance(argument, Formula) for argument in arguments):
            return Formula(name, arguments)
        return float(at_once(*arguments))

    return call


SUBSTITUTES = {name: _function(name) for name in FUNCTIONS} | {"fabs": _function("abs")}


def _is(operand: Any, number: float) -> bool:
    return not isinstance(operand, Formula) and operand == number


def _sum(left: Any, right: Any) -> Any:
    if _is(left, 0):
        return right
    if _is(right, 0):
        return left
    if isinstance(right, Formula) and right.operator == "neg":
        return Formula("-", (left, right.operands[0]))
    return Formula("+", (left, right))


def _product(left: Any, right: Any) -> Any:
    if _is(left, 0) or _is(right, 0):
        return 0.0
    if _is(left, 1):
        return right
    if _is(right, 1):
        return left
    return Formula("*", (left, right))


_COMPARED: dict[str, Callable[[float, float], bool]] = {
    "<": lambda a, b: a < b,
    "<=": lambda a, b: a <= b,
    ">": lambda a, b: a > b,
    ">=": lambda a, b: a >= b,
    "==": lambda a, b: a == b,
    "!=": lambda a, b: a != b,
}


def _compare(operator: str, left: Any, right: Any) -> Condition | bool:
    one, other = (
        side.value if isinstance(side, Formula) else float(side) for side in (left, right)
    )
    if one is None or other is None:
        return Condition(operator, left, right)
    return _COMPARED[operator](one, other)

"""What a kernel computes, outcome_of down."""

import math

import pytest
from numba import njit

from pipelines.export.formula import (
    Branch,
    Elements,
    NotWritable,
    constant,
    names_in,
    outcome_of,
)
from pipelines.export.matlab import LANGUAGE


@njit
def _half(x):
    return 0.5 * x


@njit
def _clipped(q, limit, out):
    excess = max(0.0, q[0] - limit)
    if q[1] != 0.0 and excess > 1.0:
        out[0] += -(_half(excess) ** 2) / (q[1] - 3.0)
    else:
        out[0] += math.exp(-abs(q[0]))


@njit
def _remembers(q, limit, out):
    out[0] = out[int(q[0])]


@njit
def _rounds(q, limit, out):
    out[0] = math.floor(q[0])


def formula(kernel, limit=0.25):
    def arguments():
        out = [0.0]
        return (Elements("q", 2), limit, out), out

    return outcome_of(kernel, arguments)


def test_a_choice_is_outcome_of_with_both_ways():
    assert LANGUAGE.assigned(formula(_clipped, constant("limit", 0.25)), "out") == [
        "if q(2) ~= 0.0",
        "    if max(0.0, q(1) - limit) > 1.0",
        "        out(1) = -(0.5 * max(0.0, q(1) - limit))^2.0 / (q(2) - 3.0);",
        "    else",
        "        out(1) = exp(-abs(q(1)));",
        "    end",
        "else",
        "    out(1) = exp(-abs(q(1)));",
        "end",
    ]


def test_constants_are_told_once_they_are_outcome_of():
    outcome = formula(_clipped, constant("limit", 0.25))
    assert isinstance(outcome, Branch) and set(names_in(outcome, "constant")) == {"limit"}


@pytest.mark.parametrize("kernel", [_remembers, _rounds])
def test_what_no_formula_can_say_is_refused(kernel):
    with pytest.raises(NotWritable):
        formula(kernel)

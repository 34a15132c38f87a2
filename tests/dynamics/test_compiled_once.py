"""Functions whose callers call the machine code that is there."""

import numpy as np
import pytest
from numba import njit
from numba.core.types import float64, void

from pipelines.dynamics.compiled_once import compiled_once

vector = float64[::1]


@compiled_once(float64(vector, float64))
def share(x, of):
    """Return a sum divided by a number."""
    total = 0.0
    for value in x:
        total += value
    return total / of


@compiled_once(void(vector, float64))
def stretch(x, by):
    for i in range(len(x)):
        x[i] *= by


@njit
def stretched_share(x, by, of):
    stretch(x, by)
    return share(x, of)


def test_python_and_compiled_code_call_the_same():
    x = np.array([1.0, 2.0, 3.0])
    assert share(x, 4.0) == 1.5
    assert stretched_share(x, 2.0, 4.0) == 3.0
    assert x.tolist() == [2.0, 4.0, 6.0]


def test_what_goes_wrong_inside_reaches_the_caller():
    with pytest.raises(ZeroDivisionError):
        stretched_share(np.ones(2), 1.0, 0.0)


def test_a_caller_does_not_hold_the_function_s_code():
    stretched_share(np.ones(1), 1.0, 1.0)
    (code,) = stretched_share.inspect_llvm().values()
    lines = [line for line in code.splitlines() if "test_compiled_once.share" in line]
    assert any(line.startswith("declare") for line in lines)
    assert not any(line.startswith("define") for line in lines)


def test_arguments_of_another_type_are_refused():
    with pytest.raises(TypeError):
        share(np.ones((2, 2)), 1.0)

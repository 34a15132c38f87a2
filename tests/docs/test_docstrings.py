"""The content of the docstrings of public names; ruff checks that there is one."""

import inspect
import re
from importlib import import_module
from pkgutil import walk_packages

import pytest

import pipelines
from pipelines import errors
from pipelines.estimation.estimators import ESTIMATORS

MODULES = [module.name for module in walk_packages(pipelines.__path__, "pipelines.")]
SHAPE = re.compile(r"\(\d+,\)|\([\w/ *-]+, ?\)|\([\w/]+(?: [*-] [\w/]+)?(?:, [\w.+' *-]+)+\)")
"""(n,), (2,), (n, J), (m * O, k), (end - begin, J) ..."""
ERRORS = {name for name, value in vars(errors).items() if inspect.isclass(value)} | {"ValueError"}
RAISED = re.compile(r"^\s*raise (\w+)\(", flags=re.MULTILINE)


def functions_of(module):
    """Yield the name, object and docstring of each public function and method of a module."""
    for name, value in vars(module).items():
        if name.startswith("_") or getattr(value, "__module__", None) != module.__name__:
            continue
        if inspect.isfunction(value):
            yield f"{module.__name__}.{name}", value, inspect.getdoc(value) or ""
        elif inspect.isclass(value):
            for own, member in vars(value).items():
                function = getattr(member, "fget", None) or getattr(member, "__func__", member)
                if not own.startswith("_") and inspect.isfunction(function):
                    docs = [
                        inspect.getdoc(vars(base)[own]) or ""
                        for base in value.__mro__
                        if own in vars(base)
                    ]
                    yield f"{module.__name__}.{name}.{own}", function, "\n".join(docs)


EVERY = [entry for name in MODULES for entry in functions_of(import_module(name))]


def test_the_walk_finds_the_library():
    assert len(EVERY) > 900
    assert "pipelines.estimation.long_run.long_run_covariance" in {name for name, *_ in EVERY}


def test_a_function_of_arrays_states_their_shapes():
    with_arrays = [(name, doc) for name, f, doc in EVERY if "ndarray" in str(inspect.signature(f))]
    assert len(with_arrays) > 200
    assert [name for name, doc in with_arrays if not SHAPE.search(" ".join(doc.split()))] == []


def test_a_function_that_raises_an_error_says_so():
    raising = [
        (name, set(RAISED.findall(inspect.getsource(f))) & ERRORS, doc) for name, f, doc in EVERY
    ]
    raising = [(name, errors, doc) for name, errors, doc in raising if errors]
    assert len(raising) > 40
    silent = [
        name
        for name, errors, doc in raising
        if not re.search("|".join(("[Rr]aise", "[Rr]efuse", *errors)), doc)
    ]
    assert silent == []


@pytest.mark.parametrize("estimator", ESTIMATORS, ids=lambda estimator: estimator.name)
def test_an_estimator_names_its_source(estimator):
    """Author and year; effects have a field for it, and a test of their own."""
    assert re.search(
        r"[A-Z]\w+.*\b(19|20)\d\d\b", import_module(estimator.__module__).__doc__, flags=re.DOTALL
    )

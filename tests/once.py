"""What several tests need is computed once in a run of the tests, by the first process that needs
it, and read by all others."""

import fcntl
import functools
import hashlib
import inspect
import os
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import ParamSpec, TypeVar

FOLDER = "EXOID_TESTS_ONCE"
"""The environment variable with the folder of this run's products; tests/conftest.py sets it."""

P, R = ParamSpec("P"), TypeVar("R")


def once(make: Callable[P, R]) -> Callable[P, R]:
    """Decorate a function whose result depends on its arguments alone and can be pickled.

    Each call returns a copy of its own, which a test may change. Outside a run of the tests every
    call computes.
    """
    signature = inspect.signature(make)

    @functools.wraps(make)
    def stored(*args: P.args, **kwargs: P.kwargs) -> R:
        if FOLDER not in os.environ:
            return make(*args, **kwargs)
        given = signature.bind(*args, **kwargs)
        given.apply_defaults()
        call = pickle.dumps((make.__module__, make.__qualname__, given.args, given.kwargs))
        path = Path(os.environ[FOLDER], hashlib.sha256(call).hexdigest())
        with path.with_suffix(".lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not path.exists():
                part = path.with_suffix(".part")
                part.write_bytes(pickle.dumps(make(*args, **kwargs)))
                part.rename(path)
        return pickle.loads(path.read_bytes())

    return stored

"""Compilation of the simulators' loops, with a cache that knows of all their sources.

Numba's own cache looks at the file of a compiled function only: a loop would go on calling what
another file had when it was compiled. Here all cached code goes when any source has changed.
"""

import hashlib
import os
from functools import partial
from pathlib import Path

import numba

HERE = Path(__file__).parent
SOURCES = (
    "body",
    "dry",
    "encoders",
    "further_torques",
    "loop",
    "planar",
    "smooth",
    "transmissions",
    "two_link",
    "two_mass",
)
"""Files with compiled functions."""

njit = partial(numba.njit, cache=True)


def discard_stale_code() -> None:
    """Remove cached code unless it was compiled from the sources as they are."""
    digest = hashlib.sha256(numba.__version__.encode())
    for name in SOURCES:
        digest.update((HERE / f"{name}.py").read_bytes())
    folder = HERE / "__pycache__"
    stamp = folder / "compiled.sha256"
    if stamp.exists() and stamp.read_text() == digest.hexdigest():
        return
    folder.mkdir(exist_ok=True)
    for path in (*folder.glob("*.nbi"), *folder.glob("*.nbc")):
        path.unlink(missing_ok=True)
    part = stamp.with_suffix(f".{os.getpid()}")
    part.write_text(digest.hexdigest())
    part.replace(stamp)


discard_stale_code()

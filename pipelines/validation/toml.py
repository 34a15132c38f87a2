"""TOML files as people save them."""

import tomllib
from pathlib import Path
from typing import Any


def read_toml(path: Path) -> dict[str, Any]:
    """Return what a file says; tomllib's and Unicode's errors are its own reader's to explain."""
    # Windows' editors put a byte order mark first.
    return tomllib.loads(path.read_text(encoding="utf-8-sig"))

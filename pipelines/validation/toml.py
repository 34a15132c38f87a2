"""Read TOML files, with or without a byte order mark."""

import tomllib
from pathlib import Path
from typing import Any


def read_toml(path: Path) -> dict[str, Any]:
    """Return the content of a TOML file; errors of tomllib and Unicode are left to the caller."""
    # Windows' editors put a byte order mark first.
    return tomllib.loads(path.read_text(encoding="utf-8-sig"))

"""A proposed map: each line with its reason, and whether it is sure."""

import json
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Doubt:
    """A choice to be checked by a person who knows the machine."""

    key: str
    why: str
    blocks: bool
    """Whether the map cannot be used before it is filled in."""


@dataclass
class Proposal:
    """The lines of a map in their order, and the doubts about them."""

    lines: list[str] = field(default_factory=list)
    doubts: list[Doubt] = field(default_factory=list)
    _table: str = ""

    def remark(self, text: str) -> None:
        """Add a comment."""
        self.lines.append(f"# {text}")

    def table(self, heading: str, where: str) -> None:
        """Begin a table; ``where`` is its name in doubts."""
        self.lines += ["", heading]
        self._table = where

    def key(self, name: str, value: Any, why: str = "", sure: bool = True) -> None:
        """Add a key with its value and the reason for it."""
        if not sure:
            self.doubts.append(Doubt(f"{self._table}.{name}", why, blocks=False))
        # Strings, numbers and lists are written alike in JSON and TOML.
        text = f"{name} = {json.dumps(value, ensure_ascii=False)}"
        self.lines.append(_with_reason(text, why if sure else f"UNSURE: {why}"))

    def unknown(self, name: str, why: str, blocks: bool = True) -> None:
        """Add a key whose value is in no log, as a comment to be filled in."""
        self.doubts.append(Doubt(f"{self._table}.{name}", why, blocks))
        self.lines.append(_with_reason(f"# {name} = ", f"FILL IN: {why}"))

    def doubt(self, key: str, why: str) -> None:
        """Add a doubt about several lines at once."""
        self.doubts.append(Doubt(key, why, blocks=False))
        self.remark(f"UNSURE: {key}: {why}")

    @property
    def text(self) -> str:
        """The map as TOML."""
        return "\n".join(self.lines) + "\n"


def _with_reason(text: str, why: str) -> str:
    # Column of the text at which reasons begin.
    column = 44
    return f"{text.ljust(column - 1)} # {why}" if why else text

"""An observation about a log, and the action that the import took."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Self


@dataclass(frozen=True)
class Finding:
    """One thing that is not as it should be, or that was chosen."""

    where: str
    """Time, a joint's quantity, or the rows."""
    observation: str
    action: str
    """The import's correction, or the user's next step; empty where nothing has to be done."""

    def __str__(self) -> str:
        return f"{self.where}: {self.observation}" + (f"; {self.action}" if self.action else "")

    def as_json(self) -> dict[str, str]:
        """Return it for programs, and for the recording's metadata."""
        return {"where": self.where, "found": self.observation, "done": self.action}

    @classmethod
    def from_json(cls, entry: Mapping[str, str]) -> Self:
        """Return the finding in a recording's metadata."""
        return cls(entry["where"], entry["found"], entry["done"])


Note = Callable[[str, str], None]
"""Takes an observation about one place, and the action of the import."""


def noting(where: str, findings: list[Finding]) -> Note:
    """Return a function that adds findings about a place."""
    return lambda observation, action: findings.append(Finding(where, observation, action))


def unnoted(observation: str, action: str) -> None:
    """Add no finding, as for a guess."""


def counted(number: int, what: str) -> str:
    """Return ``1 row`` or ``12 rows``."""
    return f"1 {what}" if number == 1 else f"{number:,} {what}s".replace(",", " ")

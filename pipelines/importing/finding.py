"""What was found in a log, and what was done about it."""

from dataclasses import asdict, dataclass


@dataclass(frozen=True)
class Finding:
    """One thing that is not as it should be, or that was chosen."""

    where: str
    """Time, a joint's quantity, or the rows."""
    found: str
    done: str
    """What was made of it; empty where nothing had to be."""

    def __str__(self) -> str:
        return f"{self.where}: {self.found}" + (f"; {self.done}" if self.done else "")

    def as_json(self) -> dict[str, str]:
        """Return it for programs, and for the recording's metadata."""
        return asdict(self)


def counted(number: int, what: str) -> str:
    """Return ``1 row`` or ``12 rows``."""
    return f"1 {what}" if number == 1 else f"{number:,} {what}s".replace(",", " ")

"""One thing that is wrong with a rig, in words."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Finding:
    """What was found, what was expected, and what to do."""

    device: str
    """Which device it is about, as the rig file calls it; ``rig`` for the whole."""
    text: str
    quantity: str = ""
    """The register it is about, if it is about one."""

    def __str__(self) -> str:
        return f"{self.device}: {self.text}"

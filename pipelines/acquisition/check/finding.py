"""One disagreement between a rig and its file, in words."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Finding:
    """The fault, the expected value, and a remedy."""

    device: str
    """Name of the device; ``rig`` for the whole rig."""
    text: str
    quantity: str = ""
    """Name of the register, if it is about one."""
    is_explained: bool = False
    """Whether the register itself shows the remedy, so that no other one is tried."""

    def __str__(self) -> str:
        return f"{self.device}: {self.text}"

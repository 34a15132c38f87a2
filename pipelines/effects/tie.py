"""A tie: two causes that recordings cannot separate."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Tie:
    """Why two causes look alike, and how to separate them."""

    why: str
    how_to_separate: str

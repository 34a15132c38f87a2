"""The first words of a page: what a hurried reader reads of a verdict, and nothing beside it."""

from typing import Any


def lead(verdict: dict[str, Any]) -> str:
    """Return what was found, in two sentences; the whole summary where a file of an older version
    tells no more."""
    return str(verdict.get("finding") or verdict["summary"])


def faults_in_short(verdict: dict[str, Any]) -> tuple[str, int]:
    """Return the first fault of acquisition beside a finding, and how many more there are; no words
    where none is."""
    faults = verdict["data_faults"]
    if not faults or not verdict.get("finding"):
        return "", 0
    first = faults[0]
    return f"{first['file']}, {first['channel']}: {first['what']}", len(faults) - 1

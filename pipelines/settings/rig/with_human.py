"""Limits of runs with a wearer: tighter than without, and in force in those runs only."""

from typing import Any

from pipelines.settings.base import Settings

TIGHTER = "with a wearer a limit may only be tighter"


def check_tighter(alone: Settings, with_human: Settings, *names: str) -> None:
    """Refuse limits of runs with a wearer above those of the others, by their keys.

    Raises
    ------
    ValueError
        Names the key and both limits.
    """
    for name in names:
        limit, allowed = getattr(with_human, name), getattr(alone, name)
        # None means that the limit is the one of all runs.
        if limit is not None and limit > allowed:
            raise ValueError(
                f"with_human.{name}: found {limit:g}, expected at most {name} ({allowed:g});"
                f" {TIGHTER}"
            )


def limits_in_force(with_human: Settings, run: str) -> dict[str, Any]:
    """Return the limits that replace others in a run (``exo_alone`` or ``with_human``)."""
    limits = with_human.model_dump(exclude_none=True) if run == "with_human" else {}
    # Emptied, so that the settings in force hold one limit for each key.
    return {"with_human": type(with_human)()} | limits

"""Which settings differ between two sessions, as the files of each say them."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from pipelines.report.session import Session

SECTIONS = ("mechanism", "design", "acquire", "filter", "identify", "simulate")
"""Of exoid.toml, that files repeat."""
OF_DRAWING = ("identify.figures", "simulate.figures")
"""Which no number depends on."""


@dataclass(frozen=True)
class SettingApart:
    """One setting that differs."""

    name: str
    """As exoid.toml has it: ``filter.cutoff_hz``."""
    first: str
    second: str


def settings_apart(first: Session, second: Session) -> list[SettingApart]:
    """Return every setting that both sessions' files tell, and tell differently.

    Files of one session that were made with different settings all have their say.
    """
    one, other = (_stated(session) for session in (first, second))
    return [
        SettingApart(name, " and ".join(one[name]), " and ".join(other[name]))
        for name in one
        if name in other and set(one[name]) != set(other[name]) and name not in OF_DRAWING
    ]


def _stated(session: Session) -> dict[str, list[str]]:
    by_setting: dict[str, dict[str, None]] = {}
    for artifact in session.artifacts:
        config = artifact.metadata.get("config") or {}
        for section in SECTIONS:
            for name, value in _flat(section, config.get(section)):
                by_setting.setdefault(name, {})[value] = None
    return {name: list(values) for name, values in by_setting.items()}


def _flat(name: str, value: Any) -> Iterator[tuple[str, str]]:
    if isinstance(value, Mapping):
        for key, inner in value.items():
            yield from _flat(f"{name}.{key}", inner)
    elif value is not None:
        yield name, json.dumps(value, ensure_ascii=False)

"""Settings that differ between two sessions, from the metadata of their files."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from pipelines.report.sections.provenance import SECTIONS
from pipelines.report.session import Session
from pipelines.settings import Experiment


@dataclass(frozen=True)
class SettingDifference:
    """One setting that differs."""

    name: str
    """Section and key, such as ``filter.cutoff_hz``."""
    first: str
    second: str


def settings_diff(first: Session, second: Session) -> list[SettingDifference]:
    """Return the settings that files of both sessions state, with different values.

    If files of one session disagree, all their values are listed.
    """
    # Settings of figures, on which no number depends.
    of_drawing = ("identify.figures", "simulate.figures")
    one, other = _settings(first), _settings(second)
    return [
        SettingDifference(name, " and ".join(one[name]), " and ".join(other[name]))
        for name in one
        if name in other and set(one[name]) != set(other[name]) and name not in of_drawing
    ]


def _settings(session: Session) -> dict[str, list[str]]:
    # Sections of exoid.toml that files repeat, in its order.
    sections = [name for name in Experiment.model_fields if name in (*SECTIONS, "acquire")]
    by_setting: dict[str, dict[str, None]] = {}
    for artifact in session.artifacts:
        config = artifact.metadata.get("config") or {}
        for section in sections:
            for name, value in _flat(section, config.get(section)):
                # A dictionary as an ordered set: files of a session mostly agree.
                by_setting.setdefault(name, {})[value] = None
    return {name: list(values) for name, values in by_setting.items()}


def _flat(name: str, value: Any) -> Iterator[tuple[str, str]]:
    if isinstance(value, Mapping):
        for key, inner in value.items():
            yield from _flat(f"{name}.{key}", inner)
    elif value is not None:
        yield name, json.dumps(value, ensure_ascii=False)

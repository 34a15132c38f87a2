"""The page docs/settings.md from the settings themselves; `make docs` writes it."""

import json
from collections.abc import Iterator
from typing import get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from pipelines.settings.base import models_in
from pipelines.settings.experiment import Experiment

INTRODUCTION = """\
# Settings: every key of exoid.toml

Written by `make docs` from `pipelines/settings/`; change it there. Every key may be left out.
`datasets/experiments/default.toml` is a complete file to start from.
"""
HEAD = "| key | default | meaning |\n|---|---|---|\n"


def reference() -> str:
    """Return the page as Markdown."""
    tables = [(heading, model, list(rows_of(model))) for heading, model in sections_of(Experiment)]
    sections = [
        f"## {heading}\n\n{model.__doc__}\n\n{HEAD}" + "\n".join(rows)
        for heading, model, rows in tables
        if rows
    ]
    return "\n\n".join([INTRODUCTION.rstrip(), *sections]) + "\n"


def sections_of(model: type[BaseModel], path: str = "") -> Iterator[tuple[str, type[BaseModel]]]:
    """Yield every table below a model with its heading, ``[design]`` or ``[[run]]``."""
    for name, field in model.model_fields.items():
        for inner in models_in(field.annotation):
            # Tables of a dict have names of the user's own.
            place = f"{path}{name}.NAME" if get_origin(field.annotation) is dict else path + name
            yield (f"[[{place}]]" if get_origin(field.annotation) is tuple else f"[{place}]"), inner
            yield from sections_of(inner, f"{place}.")


def grouped_sections(model: type[BaseModel]) -> Iterator[str]:
    """Yield a section of Markdown for each kind of table below a model, with all its headings."""
    # Most headings of a section's title; more stand below it.
    most = 6
    headings: dict[type[BaseModel], dict[str, None]] = {}
    for heading, inner in sections_of(model):
        headings.setdefault(inner, {})[f"`{heading}`"] = None
    for inner, names in headings.items():
        rows = list(rows_of(inner))
        if not rows:
            continue
        title, about = ", ".join(names), inner.__doc__ or ""
        if len(names) > most:
            title, about = inner.__name__, f"{about}\n\nTables: {title}."
        yield f"## {title}\n\n{about}\n\n{HEAD}" + "\n".join(rows)


def rows_of(model: type[BaseModel]) -> Iterator[str]:
    """Yield a row of Markdown for each key of a table, except subtables."""
    for name, field in model.model_fields.items():
        # A subtable has a section of its own.
        if not any(models_in(field.annotation)):
            yield f"| `{name}` | {_default(field)} | {field.description} |"


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "must be given"
    default = field.get_default(call_default_factory=True)
    return "none" if default is None else f"`{json.dumps(default)}`"


if __name__ == "__main__":
    print(reference(), end="")

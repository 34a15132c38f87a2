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


def reference() -> str:
    """Return the page as Markdown."""
    head = "| key | default | meaning |\n|---|---|---|\n"
    tables = [(heading, model, list(rows_of(model))) for heading, model in sections_of(Experiment)]
    sections = [
        f"## {heading}\n\n{model.__doc__}\n\n{head}" + "\n".join(rows)
        for heading, model, rows in tables
        if rows
    ]
    return "\n\n".join([INTRODUCTION.rstrip(), *sections]) + "\n"


def sections_of(model: type[BaseModel], path: str = "") -> Iterator[tuple[str, type[BaseModel]]]:
    """Yield every table below a model with its heading, ``[design]`` or ``[[run]]``."""
    for name, field in model.model_fields.items():
        for inner in models_in(field.annotation):
            heading = f"[{path}{name}]"
            yield f"[{heading}]" if get_origin(field.annotation) is tuple else heading, inner
            yield from sections_of(inner, f"{path}{name}.")


def rows_of(model: type[BaseModel]) -> Iterator[str]:
    """Yield a row of Markdown for each key of a table, except subtables."""
    for name, field in model.model_fields.items():
        # A subtable has a section of its own.
        if not any(models_in(field.annotation)):
            yield f"| `{name}` | {_default(field)} | {field.description} |"


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "must be given"
    return "none" if field.default is None else f"`{json.dumps(field.default)}`"


if __name__ == "__main__":
    print(reference(), end="")

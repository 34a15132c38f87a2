"""What a shell may complete where typer cannot know it: names of effects, methods, formats, runs,
stages, figures."""

from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path

import typer

from pipelines.errors import ExoidError


def effects(begun: str) -> Iterator[str]:
    """Yield the names of effects."""
    from pipelines.effects import EFFECTS

    yield from _beginning(begun, (effect.name for effect in EFFECTS))


def methods(begun: str) -> Iterator[str]:
    """Yield the names of estimators."""
    from pipelines.estimation.estimators import ESTIMATORS

    yield from _beginning(begun, (estimator.name for estimator in ESTIMATORS))


def formats(begun: str) -> Iterator[str]:
    """Yield the names of the formats that a model is exported in."""
    from pipelines.export import FORMATS

    yield from _beginning(begun, (one.name for one in FORMATS))


def runs(begun: str) -> Iterator[str]:
    """Yield the names of the runs that are recorded in the experiment in the current folder."""
    from exoid_cli.place import place_of

    with suppress(ExoidError):  # a shell has no place for what is wrong with the file
        steps = place_of(None, look_only=True).of_stage("acquire")
        yield from _beginning(begun, (step.run for step in steps if step.run))


def stages(begun: str) -> Iterator[str]:
    """Yield the stages of the experiment in the current folder."""
    from exoid_cli.place import place_of

    with suppress(ExoidError):
        yield from _beginning(
            begun, dict.fromkeys(step.stage for step in place_of(None, look_only=True).steps)
        )


def figures(context: typer.Context, begun: str) -> Iterator[str]:
    """Yield the names of the figures of the folders that were named, or of the current one."""
    from pipelines.report.figures import figures as figures_of
    from pipelines.report.session import find

    with suppress(ExoidError):
        yield from _beginning(begun, figures_of(find(context.params.get("folders") or [Path()])))


def _beginning(begun: str, names: Iterable[str]) -> Iterator[str]:
    return (name for name in names if name.startswith(begun))

"""Shell completion of names: effects, methods, formats, runs, stages, figures."""

from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path

import typer

from pipelines.errors import ExoidError


def effects(start: str) -> Iterator[str]:
    """Yield the names of effects."""
    from pipelines.effects import EFFECTS

    yield from _starting_with(start, (effect.name for effect in EFFECTS))


def methods(start: str) -> Iterator[str]:
    """Yield the names of estimators."""
    from pipelines.estimation.estimators import ESTIMATORS

    yield from _starting_with(start, (estimator.name for estimator in ESTIMATORS))


def formats(start: str) -> Iterator[str]:
    """Yield the names of the formats that a model is exported in."""
    from pipelines.export import FORMATS

    yield from _starting_with(start, (format_.name for format_ in FORMATS))


def runs(start: str) -> Iterator[str]:
    """Yield the names of the runs that are recorded in the experiment in the current folder."""
    from exoid_cli.experiment_folder import open_experiment

    with suppress(ExoidError):  # a shell cannot show an error while it completes
        steps = open_experiment(None, allow_damaged=True).of_stage("acquire")
        yield from _starting_with(start, (step.run for step in steps if step.run))


def stages(start: str) -> Iterator[str]:
    """Yield the stages of the experiment in the current folder."""
    from exoid_cli.experiment_folder import open_experiment

    with suppress(ExoidError):
        yield from _starting_with(
            start,
            dict.fromkeys(step.stage for step in open_experiment(None, allow_damaged=True).steps),
        )


def figures(context: typer.Context, start: str) -> Iterator[str]:
    """Yield the names of the figures of the folders that were named, or of the current one."""
    from pipelines.report.figure_files import figures as figures_of
    from pipelines.report.session import find

    with suppress(ExoidError):
        yield from _starting_with(
            start, figures_of(find(context.params.get("folders") or [Path()]))
        )


def _starting_with(start: str, names: Iterable[str]) -> Iterator[str]:
    return (name for name in names if name.startswith(start))

"""Shell completion of names: effects, methods, formats, runs, stages, figures.

Typer offers those names that begin as the word to be completed.
"""

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import typer

from pipelines.errors import ExoidError


def effects() -> list[str]:
    """Return the names of effects."""
    from pipelines.effects import EFFECTS

    return [effect.name for effect in EFFECTS]


def methods() -> list[str]:
    """Return the names of estimators."""
    from pipelines.estimation.estimators import ESTIMATORS

    return [estimator.name for estimator in ESTIMATORS]


def formats() -> list[str]:
    """Return the names of the formats that a model is exported in."""
    from pipelines.export import FORMATS

    return [format_.name for format_ in FORMATS]


def runs() -> Iterator[str]:
    """Yield the names of the runs that are recorded in the experiment in the current folder."""
    from exoid_cli.experiment_folder import open_experiment

    with suppress(ExoidError):  # a shell cannot show an error while it completes
        steps = open_experiment(None, allow_damaged=True).of_stage("acquire")
        yield from (step.run for step in steps if step.run)


def stages() -> Iterator[str]:
    """Yield the stages of the experiment in the current folder."""
    from exoid_cli.experiment_folder import open_experiment

    with suppress(ExoidError):
        steps = open_experiment(None, allow_damaged=True).steps
        yield from dict.fromkeys(step.stage for step in steps)


def figures(context: typer.Context) -> Iterator[str]:
    """Yield the names of the figures of the folders that were named, or of the current one."""
    from pipelines.report.figure_files import figures as figures_of
    from pipelines.report.session import find

    with suppress(ExoidError):
        yield from figures_of(find(context.params.get("folders") or [Path()]))

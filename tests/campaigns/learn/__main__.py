"""Evidence of simulated sessions, and the criteria learned from it.

Run with ``python -m tests.campaigns.learn``.
"""

import json
import os
import time
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from pipelines.diagnosis.criteria import CRITERIA
from pipelines.diagnosis.reference import MEASURED
from tests.campaigns.blind.seeds import RANGES
from tests.campaigns.learn.evidence import ONE_THREAD, write_evidence

app = typer.Typer(add_completion=False, no_args_is_help=True)
OUT = Annotated[Path, typer.Option(help="Folder of evidence and results.")]
HERE, EXAMINED = Path("build/learn"), Path("build/blind")
MIX = {"single": 0.55, "pair": 0.15, "outside": 0.12, "none": 0.09, "imperfect": 0.09}
"""Shares of what is hidden: faults of acquisition teach the decision nothing."""


class Seeds(StrEnum):
    """Whose seeds: criteria are learned on some and judged on others."""

    tuning = "tuning"
    reporting = "reporting"


class World(StrEnum):
    """Whose sessions."""

    mujoco = "mujoco"
    planar = "planar"
    two_mass = "two_mass"
    all = "all"


@app.command()
def evidence(
    world: Annotated[World, typer.Option(help="Which world.")] = World.all,
    cases: Annotated[int, typer.Option(min=1, help="Sessions of each world.")] = 400,
    seeds: Annotated[Seeds, typer.Option(help="Which range of seeds.")] = Seeds.tuning,
    seed_base: Annotated[
        int | None, typer.Option(help="First seed, instead of the range's.")
    ] = None,
    out: OUT = HERE,
    workers: Annotated[int, typer.Option(min=1)] = os.cpu_count() or 1,
) -> None:
    """Write the evidence of simulated sessions; goes on where it was stopped."""
    from tests.campaigns.blind.cases import mixed

    worlds = [w for w in World if w is not World.all] if world is World.all else [world]
    base = RANGES[seeds].start if seed_base is None else seed_base
    turns = mixed(cases * len(worlds), base, MIX, [w.value for w in worlds])
    # In an order of its own, so that a campaign that is stopped has some of everything.
    np.random.default_rng(base).shuffle(turns)
    began = time.monotonic()
    for done, name in enumerate(write_evidence(turns, out.resolve(), workers), 1):
        pace = (time.monotonic() - began) / done
        typer.echo(f"{done} {name} ({pace:.1f} s each)")


@app.command()
def fit(
    out: OUT = HERE,
    worlds: Annotated[str, typer.Option(help="Worlds to learn from, commas between.")] = "",
    folds: Annotated[str, typer.Option(help="Folds of forms left out, commas between.")] = "",
    most: Annotated[int, typer.Option(help="Sessions at most, of each world.")] = 100000,
    workers: Annotated[int, typer.Option(min=1)] = os.cpu_count() or 1,
    name: Annotated[str, typer.Option(help="Name of the result.")] = "learned",
) -> None:
    """Learn the criteria from stored evidence, and write them to OUT/NAME.json."""
    from tests.campaigns.learn.learning import learn

    for variable in ONE_THREAD:
        os.environ[variable] = "1"
    chosen = [w for w in worlds.split(",") if w]
    left_out = {int(f) for f in folds.split(",") if f}
    result = learn(out.resolve(), chosen, left_out, most, workers, CRITERIA)
    (out / f"{name}.json").write_text(json.dumps(result, indent=1))
    typer.echo(json.dumps(result["criteria"], indent=1))


@app.command("cross-validate")
def cross_validate(
    out: OUT = HERE,
    most: Annotated[int, typer.Option(help="Sessions at most, of each world.")] = 1000,
    workers: Annotated[int, typer.Option(min=1)] = os.cpu_count() or 1,
) -> None:
    """Learn without each world and each fold of forms, and judge on what was left out, for
    docs/criteria.md."""
    from tests.campaigns.learn.cross_validation import ABOUT, COLUMNS, TITLE, cross_validated

    for variable in ONE_THREAD:
        os.environ[variable] = "1"
    parts = []
    for part in cross_validated(out.resolve(), most, workers, CRITERIA):
        parts.append(part)
        typer.echo(" ".join(part.as_row()))
    if not parts:
        raise typer.BadParameter(
            f"{out} has evidence of no session to learn from; run `make evidence`"
        )
    about = ABOUT.format(most=most, revisions=parts[0].revisions)
    keep(TITLE, {"about": about, "columns": COLUMNS, "rows": [part.as_row() for part in parts]})
    typer.echo(f"written to {MEASURED}")


@app.command()
def sensitivity(
    out: OUT = HERE,
    worlds: Annotated[str, typer.Option(help="Worlds to measure on, commas between.")] = "",
    most: Annotated[int, typer.Option(help="Sessions at most, of each world.")] = 1000,
    workers: Annotated[int, typer.Option(min=1)] = os.cpu_count() or 1,
) -> None:
    """Measure what a change of each criterion does, for docs/criteria.md."""
    from tests.campaigns.learn.sensitivity import TITLE
    from tests.campaigns.learn.sensitivity import sensitivity as measured

    for variable in ONE_THREAD:
        os.environ[variable] = "1"
    chosen = [w for w in worlds.split(",") if w]
    keep(TITLE, measured(out.resolve(), chosen, most, workers, CRITERIA))
    typer.echo(f"written to {MEASURED}")


def keep(title: str, measured: dict[str, Any]) -> None:
    """Write a measurement of the criteria as a section: ``about``, ``columns`` and ``rows``."""
    measurements = json.loads(MEASURED.read_text(encoding="utf-8")) | {title: measured}
    MEASURED.write_text(
        json.dumps(measurements, indent=1, ensure_ascii=False) + "\n", encoding="utf-8"
    )


@app.command("look-alikes")
def look_alikes(
    examined: Annotated[
        Path, typer.Option(help="Folder of a blind examination on tuning seeds.")
    ] = EXAMINED,
) -> None:
    """Learn from a blind examination how likely a named cause is an unlisted effect that resembles
    it."""
    from tests.campaigns.learn.look_alikes import judged_causes, learn_look_alike

    judged = list(judged_causes(examined))
    if not judged:
        raise typer.BadParameter(f"{examined} has no answer that names a cause; run `make blind`")
    typer.echo(json.dumps(learn_look_alike(judged), indent=1))


@app.command()
def show(out: OUT = HERE) -> None:
    """Count the stored evidence."""
    from tests.campaigns.learn.objective import rows

    counts: dict[tuple[str, str], int] = {}
    seconds = []
    for row in rows(out.resolve()):
        truth = json.loads(row["truth"])
        key = (row["world"], truth["case"]["category"])
        counts[key] = counts.get(key, 0) + 1
        seconds.append(row["seconds"])
    for key, count in sorted(counts.items()):
        typer.echo(f"{' '.join(key)}: {count}")
    typer.echo(f"{np.median(seconds):.1f} s of processor time each")


if __name__ == "__main__":
    app()

"""``python -m tests.campaigns.blind``: hide effects, let ``exoid diagnose`` find them, count."""

import sys
from concurrent.futures import ProcessPoolExecutor, as_completed
from enum import StrEnum
from multiprocessing import get_context
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import track

from tests.campaigns.blind import fixed_set, report
from tests.campaigns.blind.cases import (
    MIX,
    MIX_OF_ONE_JOINT,
    SINGLES,
    Case,
    case,
    full,
    mixed,
    of_one_joint,
)
from tests.campaigns.blind.causes import WORLDS
from tests.campaigns.blind.examine import Folders, drawn, examine, prepare
from tests.campaigns.blind.plan import JOINTS
from tests.campaigns.blind.seeds import RANGES


class Seeds(StrEnum):
    """Whose seeds: a program is tuned on some and judged on others."""

    tuning = "tuning"
    reporting = "reporting"


def _written(mix: dict[str, float]) -> str:
    return ",".join(f"{category}={share}" for category, share in mix.items())


def main(
    cases: Annotated[int, typer.Option(min=1, help="How many cases.")] = 300,
    seeds: Annotated[Seeds, typer.Option(help="Which range of seeds.")] = Seeds.tuning,
    seed_base: Annotated[
        int | None, typer.Option(help="First seed, instead of the range's own.")
    ] = None,
    most: Annotated[
        int | None, typer.Option(min=1, help="Only so many of the cases, drawn at random.")
    ] = None,
    mix: Annotated[str, typer.Option(help=f"Shares of the categories, as {_written(MIX)}.")] = "",
    every: Annotated[
        bool, typer.Option("--full", help="300 with nothing hidden, 30 of each cause and joint.")
    ] = False,
    only: Annotated[
        str, typer.Option(help="Singles of this cause only, such as backlash@knee.")
    ] = "",
    out: Annotated[Path, typer.Option(help="Folder of sessions, answers and report.")] = Path(
        "build/blind"
    ),
    workers: Annotated[int, typer.Option(min=1, help="Sessions at a time.")] = 2,
    world: Annotated[str, typer.Option(help=f"One of {', '.join(WORLDS)}, or all.")] = "all",
    one_joint: Annotated[
        bool, typer.Option("--one-joint", help="Machines of one joint instead of the leg.")
    ] = False,
    fixed: Annotated[bool, typer.Option("--fixed", help="The fixed set that CI examines.")] = False,
    write: Annotated[
        bool, typer.Option("--write", help="With --fixed: diagnose again and record the result.")
    ] = False,
    again: Annotated[bool, typer.Option(help="Diagnose existing sessions again.")] = False,
    simulate_only: Annotated[bool, typer.Option(help="Make the sessions and stop.")] = False,
) -> None:
    """Examine ``exoid diagnose`` on simulated sessions whose truth it cannot see."""
    if write and not fixed:
        raise typer.BadParameter(
            "only the fixed set has a record: add --fixed", param_hint="--write"
        )
    if one_joint and (fixed or every or only):
        raise typer.BadParameter(
            "machines of one joint have mixed examinations only: leave out --fixed, --full, --only",
            param_hint="--one-joint",
        )
    if world not in (*WORLDS, "all"):
        raise typer.BadParameter(f"there is no world {world!r}", param_hint="--world")
    worlds = tuple(WORLDS) if world == "all" else (world,)
    base = RANGES[seeds].start if seed_base is None else seed_base
    planned = (
        fixed_set.fixed_set()
        if fixed
        else _planned(cases, base, mix, every, only, one_joint, worlds)
    )
    if most is not None:
        planned = drawn(planned, most)
    console = Console()
    if simulate_only:
        folders = Folders(out.resolve())
        with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
            pending = [pool.submit(prepare, one, folders) for one in planned]
            for done in track(as_completed(pending), "simulating", len(pending), console=console):
                done.result()
        return
    progress = track(
        examine(planned, out, workers, again or write),
        "examining",
        total=len(planned),
        console=console,
    )
    scores = list(progress)
    command = " ".join(["python -m tests.campaigns.blind", *sys.argv[1:]])
    report.write(out, report.Examination(command, scores))
    report.show(console, scores)
    if write:
        fixed_set.write(fixed_set.outcomes(planned, scores))


def _planned(
    cases: int,
    base: int,
    mix: str,
    every: bool,
    only: str,
    one_joint: bool,
    worlds: tuple[str, ...],
) -> list[Case]:
    if every:
        return full(base, worlds=worlds)
    if only:
        turns = [
            i
            for i, (effect, j) in enumerate(SINGLES)
            if only in (effect, f"{effect}@{JOINTS[j or 0]}")
        ]
        if not turns:
            raise typer.BadParameter(
                f"there is no cause {only!r}; one is backlash@knee", param_hint="--only"
            )
        return [
            case(base + k, "single", turns[k % len(turns)], worlds[k // len(turns) % len(worlds)])
            for k in range(cases)
        ]
    usual = MIX_OF_ONE_JOINT if one_joint else MIX
    shares = (
        {name: float(share) for name, _, share in (part.partition("=") for part in mix.split(","))}
        if mix
        else usual
    )
    if unknown := set(shares) - set(usual):
        raise typer.BadParameter(
            f"unknown category {unknown.pop()!r}, known are {', '.join(usual)}", param_hint="--mix"
        )
    return of_one_joint(cases, base, shares) if one_joint else mixed(cases, base, shares, worlds)


if __name__ == "__main__":
    typer.run(main)

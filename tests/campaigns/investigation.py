"""Does one further motion end a doubt, and as often as predicted? ``make investigation``.

In each world legs hide a small effect, are recorded with the usual excitation, and diagnosed. Of
those whose verdict leaves a choice, the same leg is recorded again: along the motion that
``exoid next`` chooses, along the usual one once more, and along a random one. All recordings are
then diagnosed together. A result is one line of ``investigation.jsonl``; started again, it goes on.
"""

import json
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from pipelines.contracts.verdict import Verdict, check
from pipelines.design.excitation import design
from pipelines.diagnosis.diagnose import diagnose
from pipelines.diagnosis.verdict.verdict import verdict
from pipelines.errors import ExoidError
from pipelines.investigation.doubt import State, doubt_of
from pipelines.investigation.next_experiments import next_experiments
from pipelines.investigation.planned import PlannedRuns
from pipelines.investigation.rivals import rivals_in_verdict
from pipelines.investigation.separation_problem import SeparationProblem
from pipelines.mechanics.fourier import FourierTrajectory
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.machine import THE_LEG
from pipelines.mechanics.read import read_motions
from pipelines.settings.design import DesignSettings
from pipelines.settings.filter import FilterSettings
from pipelines.settings.rig.plant import PlantSettings
from tests.campaigns.blind.cases import SINGLES, Case
from tests.campaigns.blind.causes import Cause, log_uniform
from tests.campaigns.blind.excitation import random_excitation
from tests.campaigns.blind.plan import JOINTS
from tests.campaigns.blind.session import PURPOSES, Session, _Draw, write
from tests.campaigns.blind.trajectories import Trajectory
from tests.campaigns.blind.worlds import WORLDS

SMALLEST, LARGEST = 0.02, 0.1
"""Magnitudes of what is hidden, share of a joint's torque: small enough for doubts."""
SECONDS = 40.0
SETTINGS = DesignSettings()


class _Leg(_Draw):
    """A leg of some world that is recorded several times, along motions of our choice."""

    def _draw(self, rng: np.random.Generator) -> None:
        super()._draw(rng)
        self.conditions = replace(
            self.conditions, duration_s=SECONDS, periodic=True, says_period=True, gaps=0
        )
        self.duration = SECONDS
        self.follow(design(SETTINGS).trajectory)

    def follow(self, motion: FourierTrajectory) -> None:
        """Let all further runs follow a motion."""
        as_drawn = Trajectory("designed", motion.period_s, motion.at(np.zeros(1))[0][0], motion.at)
        self.motion = dict.fromkeys(PURPOSES, as_drawn)

    def _wanted(self) -> list[tuple[Cause, float]]:
        rng = self.rng(8)
        return [(cause, log_uniform(rng, SMALLEST, LARGEST)) for cause, _ in super()._wanted()]

    def again(self, session: Session, motion: FourierTrajectory, number: int) -> Session:
        """Return the session's leg recorded once more, with other noise."""
        self.follow(motion)
        stream, self.stream = self.stream, [*self.stream, 1000 + number]
        causes = [(cause, size) for cause, size, _ in session.hidden + session.background]
        runs = [
            self._record(causes, kind, purpose, self.duration)
            for kind in self.case.kinds
            for purpose in PURPOSES
        ]
        self.stream = stream
        return replace(session, runs=runs, trajectories=self.motion)


def diagnosed(sessions: list[Session]) -> Verdict:
    """Return the verdict on all recordings of one leg together."""
    with TemporaryDirectory() as folder:
        files = []
        for number, session in enumerate(sessions):
            place = Path(folder, str(number))
            write(session, place / "recordings", place / "truth.json")
            for file in sorted((place / "recordings").iterdir()):
                files.append(file.rename(file.with_name(f"{number}_{file.name}")))
        motions = read_motions(files, FilterSettings(), None)
        return check(json.loads(json.dumps(verdict(diagnose(motions)))), "verdict")


def outcome(found: Verdict, true: str) -> str:
    """Return how a verdict compares with the truth: ``right``, ``wrong`` or ``open``."""
    doubt = doubt_of(found)
    if doubt.state is State.NAMED:
        labels = [cause.label for cause in found.causes]
        return "right" if labels == [true] else "wrong"
    return "wrong" if doubt.state in (State.NOTHING, State.AT_FAULT) else "open"


def examine(world: str, seed: int) -> dict[str, object]:
    """Examine one leg; ``state`` says what the first verdict leaves open."""
    # A step that shares no factor with their number, so that a few legs have different causes.
    spec = SINGLES[17 * seed % len(SINGLES)]
    case = Case(seed, "single", (spec,), world=world)
    try:
        leg = _Leg(case, 0)
        first = leg.session()
        found = diagnosed([first])
    except (ExoidError, FloatingPointError) as error:
        return {"world": world, "seed": seed, "state": "refused", "why": str(error)}
    (cause, _, _) = first.hidden[0]
    true = cause.effect + ("" if cause.joint is None else f"@{JOINTS[cause.joint]}")
    result: dict[str, object] = {"world": world, "seed": seed, "true": true}
    doubt = doubt_of(found)
    result |= {"state": doubt.state.value, "first": outcome(found, true)}
    if doubt.state is not State.OPEN:
        return result
    result["rivals"] = doubt.probabilities
    usual = design(SETTINGS).trajectory
    file = Path("verdict.json")
    try:
        runs = PlannedRuns(SETTINGS, PlantSettings()).as_in_verdict(found, file).after([usual])
        rivals = rivals_in_verdict(found, file, THE_LEG)
        problem = SeparationProblem.of(rivals, runs, usual)
        chosen = next_experiments(problem, Geometry(), usual)
    except ExoidError as error:
        return result | {"state": "refused", "why": str(error)}
    drawn = random_excitation(np.random.default_rng([seed, 9]), tries=1)
    motions = {
        "repeat": usual,
        "random": FourierTrajectory(drawn.theta0, drawn.a, drawn.b, usual.omega),
    }
    if chosen.design:
        motions["next"] = chosen.design.design.trajectory
    for number, (name, motion) in enumerate(motions.items()):
        predicted = problem.with_motion(motion)
        after = diagnosed([first, leg.again(first, motion, number)])
        result[name] = {
            "predicted": predicted.decides(),
            "outcome": outcome(after, true),
            "true": after.posterior.causes.get(true, 0.0) if after.posterior else 0.0,
        }
    return result


def todo(count: int, base: int, done: set[tuple[str, int]]) -> Iterator[tuple[str, int]]:
    """Yield the world and seed of each leg that is not examined yet."""
    for number in range(count):
        for world in WORLDS:
            if (world, base + number) not in done:
                yield world, base + number


def main(legs: int, base: int, file: Path) -> None:
    """Examine so many legs of each world, and print what came of the doubtful ones."""
    lines = file.read_text().splitlines() if file.exists() else []
    done = {(one["world"], one["seed"]) for one in map(json.loads, lines)}
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool, file.open("a") as out:
        for future in as_completed(pool.submit(examine, *one) for one in todo(legs, base, done)):
            out.write(json.dumps(future.result()) + "\n")
            out.flush()
    show([json.loads(line) for line in file.read_text().splitlines()])


def show(results: list[dict]) -> None:
    """Print how many doubts each further experiment ended, and how many it was to end."""
    doubtful = [one for one in results if "repeat" in one]
    print(f"{len(results)} legs, {len(doubtful)} whose verdict left a choice\n")
    print("| further motion | doubts | right | wrong | open | predicted to decide |")
    print("|---|---|---|---|---|---|")
    for name in ("next", "repeat", "random"):
        own = [one[name] for one in doubtful if name in one]
        shares = [sum(one["outcome"] == word for one in own) for word in ("right", "wrong", "open")]
        predicted = sum(one["predicted"] for one in own) / max(len(own), 1)
        cells = " | ".join(f"{count}" for count in (len(own), *shares))
        print(f"| {name} | {cells} | {predicted:.0%} |")


if __name__ == "__main__":
    count, first_seed, path = sys.argv[1:] or ("20", "1", "build/investigation.jsonl")
    Path(path).parent.mkdir(parents=True, exist_ok=True)
    main(int(count), int(first_seed), Path(path))

"""Do designed excitations decide between causes as they predict? ``make separation``.

Causes are drawn in pairs that the usual excitation leaves undecided, by what is predicted. Each is
hidden in a virtual leg in turn, which is recorded with the usual excitation and with the one that
separates the pair best, and diagnosed. The diagnosis knows nothing of the pair. Printed is the
probability of the true cause, given that it is one of the two, next to the predicted one.
"""

import itertools
import sys
from collections.abc import Iterator

import numpy as np

from pipelines.contracts.table import Table
from pipelines.design.excitation import design
from pipelines.diagnosis.diagnose import diagnose
from pipelines.diagnosis.verdict.verdict import verdict
from pipelines.effects import EFFECTS, Effect
from pipelines.errors import NotIdentifiable
from pipelines.investigation.planned import PlannedRuns
from pipelines.investigation.rivals import Rival
from pipelines.investigation.separating_design import separating_design
from pipelines.investigation.separation_problem import SeparationProblem
from pipelines.investigation.sized_rival import sized
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.kinematics import motion_table
from pipelines.mechanics.machine import THE_LEG
from pipelines.mechanics.motion import Motion, motion_from_table
from pipelines.mechanics.trajectory import Trajectory
from pipelines.model import BASELINE, Term
from pipelines.rig.plant import Plant
from pipelines.rig.record import record
from pipelines.settings.design import DesignSettings
from pipelines.settings.filter import FilterSettings
from pipelines.settings.rig.plant import PlantSettings

RUNS = PlannedRuns(DesignSettings(), PlantSettings())
SECONDS = 40.0
UNDECIDED = 0.5
"""Share of predicted experiments that decide, up to which a pair is drawn."""


def plain_effects() -> list[Effect]:
    """Return the causes at each joint that have the same values in each run."""
    effects = [
        one(joint=joint, on=THE_LEG)
        for one in EFFECTS
        if one.name not in BASELINE and not one.needs_temperature
        for joint in one.possible(THE_LEG)
    ]
    return [e for e in effects if not e.per_run and not any(p.per_run for p in e.linear)]


def undecided_pairs(usual: Trajectory) -> Iterator[tuple[Rival, Rival]]:
    """Yield pairs of causes that the usual excitation leaves undecided, but another may not."""
    # Once for all pairs.
    runs = RUNS.behind_background(RUNS.problem(usual, []))
    for one, other in itertools.combinations(plain_effects(), 2):
        rivals = (Rival(one, 0.5), Rival(other, 0.5))
        separated = SeparationProblem.of(rivals, runs, usual).with_motion(usual)
        if min(separated.as_json()["decided"]) < UNDECIDED and not separated.inseparable():
            yield rivals


def truth_of(rivals: tuple[Rival, Rival], number: int, usual: Trajectory) -> Term:
    """Return a rival as large as predictions take it, at the middle one of its shapes."""
    problem = RUNS.problem(usual, [one.effect for one in rivals])
    found = sized(rivals, problem, RUNS.settings.bounds)[number]
    middle = found.truths[len(found.truths) // 2]
    candidate, amplitude = middle.candidate, middle.factor
    shape = np.array(candidate.shapes[0])
    linear = np.zeros(len(candidate.effect.linear))
    if len(linear):
        linear[0] = amplitude
    elif candidate.effect.shape[0].neutral == 0.0:
        shape = amplitude * shape
    return Term(candidate.effect, np.append(linear, shape))


def session(term: Term, trajectory: Trajectory, seed: int) -> list[Motion]:
    """Record four runs of a leg that has an effect."""
    kinds = itertools.product(("exo_alone", "with_human"), ("train", "validate"))
    motions = []
    for k, (run, purpose) in enumerate(kinds):
        leg = Plant(PlantSettings(), run, seed=4 * seed + k, effects=[term])
        recording = Table(*record(leg, trajectory, SECONDS, purpose))
        motions.append(motion_from_table(motion_table(recording, FilterSettings())))
    return motions


def probability(motions: list[Motion], true: str, other: str) -> float:
    """Return the probability of the true cause, given that it is one of two."""
    causes = verdict(diagnose(motions))["posterior"]["causes"]
    own, rival = causes.get(true, 0.0), causes.get(other, 0.0)
    return own / (own + rival) if own + rival > 0.0 else np.nan


def main(pairs: int, seed: int) -> None:
    """Examine some pairs, and print a row for each truth."""
    usual = design(RUNS.settings).trajectory
    drawn = list(undecided_pairs(usual))
    np.random.default_rng(seed).shuffle(drawn)
    print("| true cause | other | usual: predicted | found | designed: predicted | found |")
    print("|---|---|---|---|---|---|", flush=True)
    for one, other in drawn[:pairs]:
        rivals = (one, other)
        try:
            problem = SeparationProblem.of(rivals, RUNS, usual)
            result = separating_design(problem, Geometry(), usual)
        except NotIdentifiable as error:
            print(f"| {one.label} | {other.label} | {error} |", flush=True)
            continue
        motions = (usual, result.design.trajectory)
        judged = (result.before, result.separation)
        predicted = [one.as_json()["expected_posterior"] for one in judged]
        for number in (0, 1):
            term = truth_of(rivals, number, usual)
            true, rival = rivals[number].label, rivals[1 - number].label
            cells = []
            for table, trajectory in zip(predicted, motions, strict=True):
                found = probability(session(term, trajectory, seed), true, rival)
                cells += [f"{table[number][number]:.2f}", f"{found:.2f}"]
            print(f"| {true} | {rival} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:] or ("12", "1")))

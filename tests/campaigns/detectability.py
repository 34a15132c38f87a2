"""From which size on does a diagnosis name a cause? ``make detectability``.

Causes are drawn. Each is hidden in a virtual leg with some multiples of the smallest size that
`exoid detect` predicts for the usual excitation, and the leg is recorded and diagnosed. Printed is
the share of sessions in which the cause, or one that is tied with it, was named.
"""

import sys

import numpy as np

from pipelines.design.excitation import design
from pipelines.diagnosis.detectability.detectability import DetectionResult, of_all_causes, usual
from pipelines.diagnosis.diagnose import diagnose
from pipelines.diagnosis.verdict.verdict import verdict
from pipelines.effects import Effect
from pipelines.mechanics.motion import Motion
from pipelines.model import Term
from tests.campaigns.separation import RUNS, plain_effects, session

MULTIPLES = (0.5, 1.0, 1.5)
SESSIONS = 3
"""For each multiple."""
POWER = 0.9


def term_of(effect: Effect, result: DetectionResult, multiple: float) -> Term | None:
    """Return a cause of a multiple of its smallest size; None if its size is no amplitude."""
    if not effect.linear or not np.isfinite(result.size):
        return None
    values = np.zeros(len(effect.parameters))
    values[0] = multiple * result.size
    values[len(effect.linear) :] = result.shape
    return Term(effect, values)


def is_named(effect: Effect, motions: list[Motion]) -> bool:
    """Return whether a diagnosis names a cause, or one that is tied with it."""
    named = verdict(diagnose(motions))["causes"]
    return any(
        (one["effect"], one["joint"]) == (effect.name, effect.joint)
        for cause in named
        for one in (cause, *cause["indistinguishable_from"])
    )


def main(causes: int, seed: int) -> None:
    """Examine some causes, and print a row for each."""
    trajectory = design(RUNS.settings).trajectory
    # A run counts as often as it is long, for causes that depend on time.
    drawn = plain_effects()
    problem = RUNS.problem(trajectory, drawn)
    results = of_all_causes(problem, POWER)
    # No working leg hides more than its joint's torque.
    drawn = [
        effect
        for effect in drawn
        if effect in results
        and usual(results[effect]).rms < float(problem.torque_rms[problem.joint(effect)])
    ]
    np.random.default_rng(seed).shuffle(drawn)
    heads = [f"{multiple:g} times" for multiple in MULTIPLES]
    print(f"| cause | smallest | {' | '.join(heads)} |")
    print(f"|---|---|{'---|' * len(heads)}", flush=True)
    for effect in drawn[:causes]:
        result = usual(results[effect])
        cells = []
        for multiple in MULTIPLES:
            term = term_of(effect, result, multiple)
            if term is None:
                break
            named = [
                is_named(effect, session(term, trajectory, 100 * seed + k)) for k in range(SESSIONS)
            ]
            cells.append(f"{np.mean(named):.2f}")
        if cells:
            size = f"{result.size:.3g} {effect.parameters[0].unit}"
            print(f"| {effect.label} | {size} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:] or ("12", "1")))

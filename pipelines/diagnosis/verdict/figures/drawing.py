"""The figures of a diagnosis: what the simulation gets wrong, and what naming the cause makes of
it."""

from pathlib import Path
from typing import Any

from matplotlib import pyplot as plt

from pipelines.diagnosis.diagnosis import Diagnosis
from pipelines.diagnosis.verdict.figures import budget, decision, dependence, simulation, verdict
from pipelines.plotting.style import STYLE, save

DRAWN_BY = {
    "decision": decision.figure,
    "verdict": verdict.figure,
    "error-budget": budget.figure,
    "simulation": simulation.figure,
    "dependence": dependence.figure,
}
"""By file name, all of ``FIGURES``: what draws it from a diagnosis and what is said of it."""
ON_SCREEN = ("simulation", "dependence")
"""Many panels to look at, not to print: a PDF of each would take as long as all the rest."""


def draw(d: Diagnosis, verdict: dict[str, Any], folder: Path) -> None:
    """Write every figure as PNG, and what is to be printed as PDF too; ``said`` is the diagnosis's
    verdict."""
    with plt.rc_context(STYLE):
        for name, figure in DRAWN_BY.items():
            save(
                figure(d, verdict), folder / name, ("png",) if name in ON_SCREEN else ("png", "pdf")
            )

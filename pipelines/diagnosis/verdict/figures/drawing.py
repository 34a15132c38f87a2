"""Draw all figures of a diagnosis."""

from pathlib import Path

from matplotlib import pyplot as plt

from pipelines.contracts.verdict import Verdict
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
"""The function that draws each of ``FIGURES`` from a diagnosis and its verdict, by file name."""
ON_SCREEN = ("simulation", "dependence")
"""Figures of many panels for the screen: a PDF of each takes as long as all others."""


def draw(d: Diagnosis, checked: Verdict, folder: Path) -> None:
    """Write every figure as PNG, and those to print as PDF too."""
    with plt.rc_context(STYLE):
        for name, figure in DRAWN_BY.items():
            save(
                figure(d, checked), folder / name, ("png",) if name in ON_SCREEN else ("png", "pdf")
            )

"""Draw all figures of a diagnosis."""

from pathlib import Path

from matplotlib import pyplot as plt

from pipelines.contracts.verdict import Verdict
from pipelines.diagnosis.diagnosis import Diagnosis
from pipelines.diagnosis.verdict.figures import (
    WITH_DETECTION_LINES,
    budget,
    decision,
    dependence,
    detection_lines,
    simulation,
    verdict,
)
from pipelines.plotting.style import STYLE, save

DRAWN_BY = {
    "decision": decision.figure,
    "verdict": verdict.figure,
    "error-budget": budget.figure,
    "simulation": simulation.figure,
    "dependence": dependence.figure,
}
"""The function that draws each of ``FIGURES`` from a diagnosis and its verdict, by file name."""


def draw(d: Diagnosis, checked: Verdict, folder: Path) -> None:
    """Write every figure as PNG, and those to print as PDF too."""
    with plt.rc_context(STYLE):
        for name, figure in DRAWN_BY.items():
            # Those of many panels are for the screen: a PDF of each takes as long as all others.
            on_screen = name in ("simulation", "dependence")
            save(figure(d, checked), folder / name, ("png",) if on_screen else ("png", "pdf"))
        if checked.detection_lines:
            save(detection_lines.figure(d, checked), folder / WITH_DETECTION_LINES)

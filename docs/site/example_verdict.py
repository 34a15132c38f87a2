"""The example verdict of README.md and of pages: ``python docs/site/example_verdict.py``.

A knee spring and a hip encoder's offset are hidden in a virtual leg. ``exoid diagnose`` gets its
recordings; its figures go to docs/images, and its output into the pages, below each
comment ``<!-- example_verdict: PART -->``.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from pipelines.contracts import RECORDING
from pipelines.contracts.provenance import describe
from pipelines.mechanics.fourier import FourierTrajectory
from pipelines.model import effect_named, term_from
from pipelines.rig.plant import Plant
from pipelines.rig.record import record
from pipelines.settings.rig.plant import PlantSettings

DOCS = Path(__file__).parents[1]
PAGES = (DOCS.parent / "README.md", DOCS / "verdict.md")
FIGURES = ("decision", "verdict")
HIDDEN = [
    term_from(
        effect_named("parallel_spring")(joint="knee"), {"stiffness": 8.0, "rest_angle": -0.9}
    ),
    term_from(effect_named("encoder_offset")(joint="hip"), {"offset": 0.05}),
]
EXCITATION = FourierTrajectory(
    theta0=np.array([0.65, -0.93]),
    a=np.array([[0.22, -0.16, 0.10], [0.12, 0.24, -0.11]]),
    b=np.array([[0.10, 0.12, -0.07], [-0.22, 0.08, 0.10]]),
    omega=2 * np.pi / 5.0,
)
"""Angles in rad: a mean, and sines and cosines of three harmonics for hip and knee."""
DURATION_S = 40.0
PARTS = {
    "summary": "Missing from the simulation",
    "missing": "is anything missing?",
    "path": "what is missing, and where",
    "shares": "where the error of rigid body",
    "errors": "torque error on data",
    "cause": "parallel_spring at the knee",
}
"""How the paragraphs of the printed verdict begin."""
MARK = re.compile(r"(<!-- example_verdict: ([\w ]+) -->\n```text\n).*?(```)", re.DOTALL)


def record_all(folder: Path) -> list[Path]:
    """Write recordings of all runs of the leg."""
    paths = []
    runs = [(run, why) for run in ("exo_alone", "with_human") for why in ("train", "validate")]
    for seed, (run, purpose) in enumerate(runs):
        leg = Plant(PlantSettings(), run, seed=seed, effects=HIDDEN)
        frame, metadata = record(leg, EXCITATION, DURATION_S, purpose)
        paths.append(folder / f"{run}_{purpose}.parquet")
        RECORDING.write(paths[-1], frame, metadata | describe())
    return paths


def diagnosed(folder: Path) -> str:
    """Diagnose the recordings into a folder and return the output, 80 columns wide."""
    recordings = record_all(folder)
    command = [sys.executable, "-m", "exoid_cli", "diagnose", *recordings, "-o", folder]
    wide = os.environ | {"COLUMNS": "80"}
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=wide)
    return done.stdout


def paragraphs(printed: str) -> dict[str, str]:
    """Return the parts of the output by their names."""
    parts = {}
    for paragraph in printed.split("\n\n"):
        for name, begin in PARTS.items():
            if paragraph.startswith(begin):
                parts[name] = "\n".join(map(_wrapped, paragraph.splitlines())) + "\n"
    return parts


def _wrapped(line: str) -> str:
    """Break a sentence as a terminal of 80 columns does; a pipe gets it whole."""
    return re.sub(r"(?=.{81})(.{1,80})(?: |$)", r"\1\n", line).rstrip("\n")


def filled(page: str, parts: dict[str, str]) -> str:
    """Return a page with the printed parts that it names."""

    def fill(match: re.Match[str]) -> str:
        return match[1] + "\n".join(parts[name] for name in match[2].split()) + match[3]

    return MARK.sub(fill, page)


def main() -> None:
    """Write figures and pages."""
    with tempfile.TemporaryDirectory() as name:
        parts = paragraphs(diagnosed(Path(name)))
        for figure in FIGURES:
            shutil.copy(Path(name) / f"{figure}.png", DOCS / "images")
    # All before any is written: a part may be missing.
    pages = {page: filled(page.read_text(encoding="utf-8"), parts) for page in PAGES}
    for page, text in pages.items():
        page.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()

"""Measure the tables and figures of docs/real-data.md (``make real``).

python -m tests.campaigns.real docs/real-data.md --machines emps A0-fourier
"""

import argparse
import os
import re
import shutil
from pathlib import Path
from tempfile import TemporaryDirectory

# Before NumPy is loaded: one core is enough.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from tests.campaigns.real import tables
from tests.campaigns.real.folder import real_data_folder
from tests.campaigns.real.machines import LOGS, Diagnosed, diagnosed

END = "<!-- until here -->"
IMAGES = {"emps": "verdict", "A0-fourier": "dependence", "xl330": "verdict"}
"""Figure of each machine's diagnosis that the page shows."""


def written(page: str, name: str, measured: str) -> str:
    """Return the page with a measured table between the marks of a name."""
    between = re.compile(
        f"(?<=<!-- measured: {re.escape(name)} -->\n).*?(?={re.escape(END)})", re.DOTALL
    )
    return between.sub(lambda old: f"\n{measured}\n\n", page, count=1)


def measured(diagnoses: dict[str, Diagnosed], data: Path) -> dict[str, str]:
    """Return each table of the page whose machines were diagnosed."""
    parts = {"verdicts": tables.verdicts(diagnoses)} if set(diagnoses) == set(LOGS) else {}
    if "emps" in diagnoses:
        parts |= {
            "emps": tables.emps(diagnoses),
            "emps-pulses": tables.flexibility(diagnoses["emps"]),
        }
    for mark, keys in {
        "A0": ("A0-fourier", "A0-swings"),
        "C1": ("C1-swings",),
        "C1-known": ("C1-known",),
    }.items():
        if here := [diagnoses[key] for key in keys if key in diagnoses]:
            parts[mark] = tables.pendulum(
                here, data / "double_pendulum" / f"{mark[:2]}_published_parameters.yml"
            )
    if any(len(one.motions[0].joints) == 2 for one in diagnoses.values()):
        parts["timing"] = tables.timing(
            {key: one for key, one in diagnoses.items() if not LOGS[key].known}
        )
    if "A0-swings" in diagnoses:
        published = data / "double_pendulum" / "A0_published_parameters.yml"
        parts["A0-swings-zeros"] = tables.with_zeros(diagnoses["A0-swings"], published)
    if "A0-fourier" in diagnoses:
        parts["A0-orders"] = tables.by_order(diagnoses["A0-fourier"])
    for key, one in diagnoses.items():
        parts[f"{key}-turning"] = tables.turning(one)
        if any(cause["each_run"] for cause in one.verdict["causes"]):
            parts[f"{key}-each-run"] = tables.of_each_run(one)
        if LOGS[key].known:
            parts[f"{key}-known"] = tables.sizes(one, "known")
        parts[f"{key}-sizes"] = tables.sizes(one, "causes")
        parts |= {
            f"{key}-depends": tables.depends(one),
            f"{key}-says": f"> {one.verdict['summary']}",
        }
    return parts


def main() -> None:
    """Measure, and write tables and figures in place of the old ones."""
    parser = argparse.ArgumentParser(prog="python -m tests.campaigns.real", description=__doc__)
    parser.add_argument("page", type=Path, nargs="?", default=Path("docs/real-data.md"))
    parser.add_argument("--machines", nargs="+", choices=list(LOGS), default=list(LOGS))
    chosen, data = parser.parse_args(), real_data_folder()
    if not data.is_dir():
        parser.error(f"no real data in {data}; EXOID_REAL_DATA names their folder")
    with TemporaryDirectory() as folder:
        diagnoses = {
            name: diagnosed(LOGS[name], data, Path(folder) / name, figures=True)
            for name in chosen.machines
        }
        text = chosen.page.read_text(encoding="utf-8")
        for name, table in measured(diagnoses, data).items():
            text = written(text, name, table)
        for name, figure in IMAGES.items():
            if name in diagnoses:
                shutil.copy(
                    diagnoses[name].folder / f"{figure}.png",
                    chosen.page.parent / "images" / f"real-{name}.png",
                )
    chosen.page.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()

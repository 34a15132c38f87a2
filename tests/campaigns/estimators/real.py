"""Recordings of real machines: what the methods find, and what they leave of runs not fitted."""

import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from exoid_cli.app import run
from pipelines.errors import InputError
from pipelines.estimation.estimator import Estimator
from pipelines.identification import identify
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.motion import Motion
from pipelines.mechanics.read import read_motions
from pipelines.settings.datasets import datasets
from pipelines.settings.filter import FilterSettings
from tests.campaigns.estimators.markdown import show as table
from tests.campaigns.real.folder import real_data_folder

MACHINES = {
    "emps": ("emps/*.mat", "emps.toml"),
    "double pendulum A0": ("double_pendulum/A0_fourier_75s.csv", "double_pendulum_fourier.toml"),
}
# Of the benchmark's authors: volts for metres and for metres a second, times 35.1507 N/V.
CONTROLLERS = {
    "axis": {"type": "pd", "kp_n_m": 35.1507 * 160.18 * 243.45, "kd_n_s_m": 35.1507 * 243.45}
}
FOLDER = real_data_folder()


def show(methods: Sequence[Estimator]) -> None:
    """Print a table for each machine, or say that there are no data."""
    if not FOLDER.is_dir():
        print(f"\nno real data in {FOLDER}; EXOID_REAL_DATA names their folder")
        return
    for name, (pattern, map_name) in MACHINES.items():
        with tempfile.TemporaryDirectory() as folder:
            files = sorted(str(file) for file in FOLDER.glob(pattern))
            run(
                [
                    "--quiet",
                    "import",
                    *files,
                    "--map",
                    str(datasets() / "maps" / map_name),
                    "-o",
                    folder,
                ]
            )
            motions = read_motions(
                sorted(Path(folder).glob("*.parquet")), FilterSettings(), Geometry()
            )
        motions = [
            replace(motion, metadata={**motion.metadata, "controller": CONTROLLERS})
            for motion in motions
        ]
        names = identify(motions).parameters
        symbols = [
            f"{row.joint} {row.symbol}" if isinstance(row.joint, str) else row.symbol
            for row in names.itertuples()
        ]
        table(
            f"**{name}**",
            ("method", *symbols, "100 e/τ on the run not fitted", "s"),
            _rows(methods, motions),
        )


def _rows(methods: Sequence[Estimator], motions: list[Motion]) -> Iterator[tuple[str, ...]]:
    for estimator in methods:
        begun = time.process_time()
        try:
            found = identify(motions, estimator)
        except InputError as error:
            yield (estimator.name, f"refused: {error}")
            continue
        seconds = time.process_time() - begun
        rows = found.parameters
        pooled = found.validation.pooled
        yield (
            estimator.name,
            *(f"{row.value:.4g} ± {row.ci95_high - row.value:.2g}" for row in rows.itertuples()),
            " / ".join(f"{share:.2f}" for share in 100.0 * pooled.rmse / pooled.torque_rms),
            f"{seconds:.2g}",
        )
        for remark in found.remarks:
            print(f"<!-- {remark} -->")

"""A session that is read and fitted piece by piece is the one that is fitted whole."""

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest
from numpy.testing import assert_allclose
from pandas.testing import assert_frame_equal

from pipelines.contracts import RECORDING, parquet
from pipelines.identification import figures, identify
from pipelines.identification.validation import residuals
from pipelines.mechanics import kinematics, run
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.read import read_motions, read_runs
from pipelines.rig.plant import Plant
from pipelines.rig.record import record
from pipelines.settings.filter import FilterSettings
from pipelines.settings.rig.plant import PlantSettings
from tests.identification.conftest import RICH


@pytest.fixture(scope="module")
def recordings(tmp_path_factory):
    """Four runs of 20 s with gaps in them, at places that no piece and no block knows of."""
    folder = tmp_path_factory.mktemp("recordings")
    for kind in ("exo_alone", "with_human"):
        for seed, purpose in enumerate(("train", "validate")):
            frame, metadata = record(Plant(PlantSettings(), kind, seed=seed), RICH, 20.0, purpose)
            holed = frame.drop(index=[*range(1003, 1100), *range(2101, 2117)])
            RECORDING.write(folder / f"{kind}_{purpose}.parquet", holed, metadata)
    return sorted(folder.iterdir())


def test_pieces_change_nothing_but_rounding(recordings, monkeypatch):
    motions = read_motions(recordings, FilterSettings(), Geometry())
    whole = identify(motions)
    for module, name in ((parquet, "ROWS"), (kinematics, "WINDOW"), (run, "WINDOW")):
        monkeypatch.setattr(module, name, 611)
    runs = read_runs(recordings, FilterSettings(), Geometry())
    assert len(list(runs[0].pieces(40))) > 5
    found = identify(runs)
    scale = whole.parameters["std_error"]
    for column in ("value", "std_error", "ci95_low", "ci95_high"):
        assert_allclose(
            (found.parameters[column] - whole.parameters[column]) / scale, 0.0, atol=1e-7
        )
    assert_allclose(
        found.covariance, whole.covariance, rtol=0, atol=1e-7 * np.abs(whole.covariance).max()
    )
    assert_allclose(found.one_step, whole.one_step, rtol=1e-8)
    assert_allclose(found.validation.pooled.rmse, whole.validation.pooled.rmse, rtol=1e-9)
    left = [
        pa.concat_tables(residuals(some, whole.model_of, "baseline"))
        .to_pandas()
        .reset_index(drop=True)
        for some in (runs, motions)
    ]
    assert_frame_equal(*left, rtol=1e-8, atol=1e-8)


def test_a_figure_of_a_long_run_has_rows_from_all_of_it_and_the_error_of_all_of_it():
    rng = np.random.default_rng(0)
    n = 5000
    whole = pd.DataFrame(
        {"time_s": np.arange(n), "scored": rng.random(n) < 0.8, "left": rng.standard_normal(n)}
    )
    drawn = figures._RunData(whole.iloc[:0], most=100)
    for start in range(0, n, 37):
        drawn.add(whole.iloc[start : start + 37], ["left"])
    assert 50 <= len(drawn.frame) <= 100
    assert set(np.diff(drawn.frame["time_s"])) == {drawn.every}
    assert drawn.frame["time_s"].iloc[-1] >= n - 2 * drawn.every
    assert drawn.rms("left") == pytest.approx(np.sqrt(np.mean(whole["left"][whole["scored"]] ** 2)))

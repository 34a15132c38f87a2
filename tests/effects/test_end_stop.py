"""A stop within the range: its law, and where it is looked for."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pipelines.diagnosis.candidates.shape_grid import values_in
from pipelines.diagnosis.evidence.baseline import baseline_of
from pipelines.diagnosis.evidence.observed_run import observe
from pipelines.effects.end_stop import EndStop
from tests.diagnosis.sessions import session


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.0])
@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_a_stop_resists_on_its_side_by_a_power_of_the_depth(with_human, direction, exponent):
    """At a depth of 0.1 rad every exponent gives stiffness times depth."""
    stop = EndStop("knee")
    torque = stop.torque(with_human, np.array([30.0, -0.9, direction, exponent]))[:, 1]
    depth = direction * (with_human.q[:, 1] + 0.9)
    assert (torque[depth <= 0.0] == 0.0).all()
    assert (direction * torque[depth > 0.0] > 0.0).all()
    expected = direction * 30.0 * 0.1 * np.maximum(depth / 0.1, 0.0) ** exponent
    assert_allclose(torque, expected, atol=1e-12)


def test_a_stop_is_looked_for_within_the_angles_that_the_runs_sweep():
    runs = [observe(m) for m in session() if m.purpose == "train"]
    stop = EndStop("knee", on=baseline_of(runs).machine)
    tried = values_in(stop, stop.shape[0], 16, runs)
    knee = np.concatenate([run.state[0][:, 1] for run in runs])
    assert len(tried) == 16
    assert knee.min() < tried.min() and tried.max() < knee.max()

"""What training runs that move little do not show, and validation runs do, is sought on all runs."""

from dataclasses import replace

import numpy as np
import pytest

from pipelines.diagnosis.diagnose import diagnose
from pipelines.diagnosis.fit.joint_refinement import Refinement
from pipelines.diagnosis.verdict.verdict import verdict
from tests.diagnosis.sessions import RICH, session
from tests.diagnosis.test_diagnose import labels

POOR = replace(RICH, a=0.3 * RICH.a, b=0.3 * RICH.b)
"""So slow that a drag with the speed squared is a tenth of what it is on the validation runs."""


@pytest.fixture(scope="module")
def found():
    return diagnose(session("quadratic_drag", "hip", seed=7, trained=POOR, drag=6.0))


def test_a_drag_that_slow_training_runs_do_not_show_is_named_by_all_runs(found):
    said = verdict(found)
    assert said["sought_on"] == "all"
    assert ("quadratic_drag", "hip") in labels(said["causes"][0])
    assert any("by the training runs alone no cause would be named" in caveat for caveat in said["caveats"])


def test_it_is_fitted_to_the_training_runs_alone(found):
    assert [run.motion.purpose for run in found.prepared.runs] == ["train", "train"]
    refine = Refinement(found.prepared.runs, found.baseline, found.prepared.weights)
    by_training = refine(found.after.fit.causes)
    np.testing.assert_allclose(found.after.fit.values, by_training.values, rtol=1e-3, atol=1e-6)


def test_where_nothing_is_missing_all_runs_show_nothing_either():
    said = verdict(diagnose(session(seed=7, trained=POOR)))
    assert (said["status"], said["sought_on"]) == ("nothing_missing", "train")
    assert not any("training runs alone" in caveat for caveat in said["caveats"])


def test_what_the_training_runs_show_is_sought_on_them():
    said = verdict(diagnose(session("torque_gain", "hip", seed=3, gain=1.08)))
    assert (said["status"], said["sought_on"]) == ("explained", "train")

"""What would end a doubt: motions where they can, tests by hand where no motion can."""

import numpy as np
import pytest

from pipelines.design.excitation import design
from pipelines.investigation.next_experiments import next_experiments
from pipelines.investigation.planned import PlannedRuns
from pipelines.investigation.rivals import Rival, rivals_named
from pipelines.investigation.separation import decided
from pipelines.investigation.separation_problem import SeparationProblem
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.machine import THE_LEG
from pipelines.settings.design import DesignSettings
from pipelines.settings.rig.plant import PlantSettings

QUICK = DesignSettings(harmonics=3, particles=12, iterations=50, seconds=15.0)


@pytest.fixture(scope="module")
def usual():
    return design(QUICK).trajectory


def compared(usual, probabilities, *labels, kinds=("exo_alone", "with_human")):
    rivals = [
        Rival(one.effect, p)
        for one, p in zip(rivals_named(labels, THE_LEG), probabilities, strict=True)
    ]
    runs = PlannedRuns(QUICK, PlantSettings(), kinds)
    return next_experiments(SeparationProblem.of(rivals, runs, usual), Geometry(), usual)


def decides(result, what):
    return [one.decides for one in result.experiments if one.what == what]


def test_a_motion_is_advised_where_the_last_one_cannot_decide(usual):
    result = compared(usual, (0.6, 0.4), "mass_off_axis@hip", "torque_offset@hip")
    (again,), (motion,) = decides(result, "repeat"), decides(result, "motion")
    assert motion > again + 0.3
    assert result.design is not None
    ordered = [one.decides for one in result.experiments]
    assert np.all(np.diff(ordered) <= 0.005), "the best first"
    # Both kinds of run were recorded.
    assert not decides(result, "run")


def test_a_decision_for_the_wrong_cause_does_not_count():
    posterior = np.zeros((2, 4, 2))
    posterior[0, :, 0], posterior[1, :, 0] = 0.96, [0.99, 0.96, 0.5, 0.03]
    posterior[:, :, 1] = 1.0 - posterior[:, :, 0]
    assert decided(posterior) == pytest.approx([1.0, 0.25])


def test_where_no_motion_separates_causes_a_test_by_hand_does(usual):
    result = compared(usual, (0.6, 0.4), "base_tilt", "encoder_offset@hip", kinds=("exo_alone",))
    assert result.design is None
    assert decides(result, "motion") == [0.0]
    assert max(*decides(result, "repeat"), *decides(result, "run")) <= 0.01
    # Whether the base is tilted or not, one cause remains.
    assert decides(result, "test") == pytest.approx([1.0, 1.0])
    assert "spirit level" in result.experiments[0].words


def test_a_test_of_one_cause_of_three_decides_if_it_is_there(usual):
    labels = ("base_tilt", "encoder_offset@hip", "parallel_spring@hip")
    result = compared(usual, (0.5, 0.3, 0.2), *labels)
    assert sorted(decides(result, "test")) == pytest.approx([0.2, 0.3, 0.5])

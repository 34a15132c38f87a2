"""An excitation that is designed for sizes shows causes of these sizes; a usual one does not."""

import numpy as np
import pytest

from pipelines.design.excitation import design
from pipelines.diagnosis.diagnose import diagnose
from pipelines.errors import InputError
from pipelines.investigation.planned import PlannedRuns
from pipelines.investigation.sizes_design import sizes_design, smallest_sizes
from pipelines.investigation.wanted_sizes import SmallestSizes, wanted_sizes
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.machine import THE_LEG
from pipelines.model import Term
from pipelines.settings.design import DesignSettings
from pipelines.settings.rig.plant import PlantSettings
from tests.campaigns.separation import session

QUICK = DesignSettings(harmonics=3, particles=12, iterations=50)
RUNS = PlannedRuns(QUICK, PlantSettings())
HIDDEN = "rotor_inertia@knee=0.25"


@pytest.fixture(scope="module")
def usual():
    return design(QUICK).trajectory


@pytest.fixture(scope="module")
def before(usual):
    return smallest_sizes(wanted_sizes([HIDDEN, "cogging@knee=0.5"], THE_LEG), RUNS, usual)


@pytest.fixture(scope="module")
def designed(before):
    return sizes_design(before, RUNS, Geometry())


def test_a_design_shows_a_size_that_the_usual_excitation_hides(before, designed):
    assert before.shares()[0] < 0.9
    assert np.all(designed.sizes.shares() > 1.0)
    assert all(margin.kept for margin in designed.design.quality.margins)


def test_its_metadata_say_what_it_shows_and_what_the_last_one_did(designed):
    metadata = designed.metadata()
    assert metadata["criterion"] == "sizes"
    assert metadata["criterion_value"] == pytest.approx(designed.sizes.shares().min())
    assert [row["cause"] for row in metadata["sizes"]] == ["rotor_inertia@knee", "cogging@knee"]
    assert [row["shows"] for row in metadata["sizes_before"]] == [False, True]


@pytest.mark.slow
def test_equal_settings_give_an_equal_design(before, designed):
    again = sizes_design(before, RUNS, Geometry()).design.trajectory
    assert np.array_equal(again.a, designed.design.trajectory.a)


@pytest.mark.slow
def test_a_diagnosis_names_the_size_in_the_designed_excitation(designed):
    (one,) = wanted_sizes([HIDDEN], THE_LEG)
    term = Term(one.effect, np.array([1.2 * one.size]))
    assert list(diagnose(session(term, designed.design.trajectory, 12)).causes) == [one.label]


def test_of_a_stiffness_less_is_more_and_a_gain_is_counted_from_one(usual):
    texts = ["joint_elasticity@knee={}", "torque_gain@hip={}", "encoder_offset@knee={}"]
    small, large = ((2000.0, 1.01, 0.005), (150.0, 1.2, 0.15))
    for sizes, shows in ((small, False), (large, True)):
        wanted = wanted_sizes([t.format(x) for t, x in zip(texts, sizes, strict=True)], THE_LEG)
        assert [row["shows"] for row in smallest_sizes(wanted, RUNS, usual).as_json()] == [
            shows
        ] * 3


@pytest.mark.parametrize(
    ("texts", "message"),
    [
        (["cogging@knee"], "expected EFFECT@JOINT=SIZE with a size above 0"),
        (["cogging@knee=-1"], "expected EFFECT@JOINT=SIZE with a size above 0"),
        (["cogging@knee=nan"], "expected EFFECT@JOINT=SIZE with a size above 0"),
        (["=1"], "expected EFFECT@JOINT=SIZE with a size above 0"),
        (["cogging@knee=1", "cogging@knee=2"], "expected each cause once"),
        (["friction@knee=1"], "friction@knee, which every model has"),
        (["cogging@elbow=1"], "expected cogging@hip or cogging@knee"),
        ([], "found no cause"),
    ],
)
def test_what_is_no_wanted_size_is_refused(texts, message):
    with pytest.raises(InputError) as caught:
        wanted_sizes(texts, THE_LEG)
    assert message in str(caught.value) and "\n" not in str(caught.value)


def test_where_a_cause_is_impossible_the_expected_ones_are_no_part_of_every_model():
    with pytest.raises(InputError) as caught:
        wanted_sizes(["rotor_coupling@knee=1"], THE_LEG)
    assert "cogging@knee" in str(caught.value) and " friction@knee" not in str(caught.value)


def test_a_share_is_inverted_for_a_stiffness_alone_whatever_the_background():
    """A search ends within a hundredth of a size, so that a size may seem to shrink by as much."""
    texts = ["joint_elasticity@knee=150", "encoder_offset@knee=0.05"]
    wanted = tuple(wanted_sizes(texts, THE_LEG))
    for growth in (0.995, 1.005):
        shares = SmallestSizes(wanted, (300.0, 0.1), (growth, growth)).shares()
        assert shares == pytest.approx([2.0, 0.5])


def test_a_cause_that_planned_runs_cannot_show_is_refused(usual):
    wanted = wanted_sizes(["friction_temperature@knee=0.1"], THE_LEG)
    with pytest.raises(InputError, match=r"friction_temperature@knee cannot show in planned runs"):
        smallest_sizes(wanted, RUNS, usual)

"""A double pendulum whose makers published its parameters: joint torques are foretold better than by these."""

import pytest

from tests.real.machines import LOGS, diagnosed, of_purpose, with_rotor
from tests.real.published import double_pendulum, their_torque
from tests.real.relative_error import slow_error, slow_fit


@pytest.fixture(scope="module")
def fourier(real_data, tmp_path_factory):
    return diagnosed(LOGS["A0-fourier"], real_data, tmp_path_factory.mktemp("A0"))


@pytest.fixture(scope="module")
def theirs(real_data):
    return double_pendulum(real_data / "double_pendulum" / "A0_published_parameters.yml")


def test_the_extended_model_is_better_than_the_published_parameters(fourier, theirs):
    for motion in fourier.motions:
        ours = slow_error(fourier.model.torque(motion), motion)
        published = slow_error(their_torque(theirs, motion), motion)
        assert (ours.rms < published.rms).all(), motion.file


def test_friction_that_goes_with_the_load_of_a_planetary_gear_is_named_and_foretells_what_no_fit_has_seen(fourier):
    assert fourier.causes[0] == ("load_dependent_friction", "shoulder")
    assert not any(
        fault["channel"] == "time_s" for fault in fourier.verdict["data_faults"] if "rebuild" in fault["what"]
    )
    (seen_by_none,) = of_purpose(fourier.motions, "validate")
    plain = slow_fit(with_rotor(seen_by_none), of_purpose(fourier.motions, "train"))
    ours, theirs = (slow_error(model.torque(seen_by_none), seen_by_none) for model in (fourier.model, plain))
    assert ours.percent[0] < 6.0
    assert (ours.rms < theirs.rms).all()


@pytest.mark.slow
@pytest.mark.parametrize(("design", "named"), [("A0", ("rotor_inertia", "elbow")), ("C1", None)])
def test_in_free_swings_nothing_but_the_rotor_is_accused_first_and_the_shoulder_is_foretold_better_than_by_its_makers(
    design, named, real_data, tmp_path_factory
):
    """Inertia and gravity nearly cancel there: noise of the angles must pass for no cause, nor for a wrong sign."""
    swings = diagnosed(LOGS[f"{design}-swings"], real_data, tmp_path_factory.mktemp(design))
    assert next(iter(swings.causes), None) == named
    assert not any("reversed" in fault["what"] for fault in swings.verdict["data_faults"])
    assert any("no torque goes with" in caveat for caveat in swings.verdict["caveats"])
    theirs = double_pendulum(real_data / "double_pendulum" / f"{design}_published_parameters.yml")
    for motion in swings.motions:
        ours = slow_error(swings.model.torque(motion), motion)
        published = slow_error(their_torque(theirs, motion), motion)
        assert ours.rms[0] < published.rms[0], motion.file
    if named:  # what no motion tells apart from it is the rotor's coupling, -gr Ir
        rotor = swings.verdict["causes"][0]["parameters"][0]
        assert rotor["value"] == pytest.approx((theirs["gr"] ** 2 + theirs["gr"]) * theirs["Ir"], rel=0.35)

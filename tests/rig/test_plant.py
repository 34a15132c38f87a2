import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from pipelines.contracts import RECORDING
from pipelines.errors import SettingsError
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.mechanisms.leg import LEG, cuff_torque
from pipelines.rig.plant import Plant
from pipelines.rig.record import record
from pipelines.settings.rig.plant import PlantEffect, PlantSettings

RATE = 200.0
ENABLED = np.ones(2, dtype=bool)


def move(plant, excitation, seconds=4.0):
    """Follow the excitation; the first period, which starts with a jump, is left out."""
    plant.run(excitation.at(np.arange(0, 2, 1 / RATE))[0], ENABLED)
    return plant.run(excitation.at(np.arange(0, seconds, 1 / RATE))[0], ENABLED)


def friction(settings, dq):
    return np.array(settings.coulomb_nm) * np.sign(dq) + np.array(settings.viscous_nm_s_rad) * dq


@pytest.mark.parametrize("run", ["exo_alone", "with_human"])
def test_the_drives_deliver_what_the_true_parameters_ask_for(silent, excitation, run):
    measured = move(Plant(silent, run), excitation)
    X = np.array(silent.exo_inertial) + (run == "with_human") * np.array(silent.human_inertial)
    q, dq, ddq = (np.ascontiguousarray(measured.truth[:, i]) for i in range(3))
    needed = LEG.regressor(
        q, dq, ddq, Geometry(silent.thigh_length_m, silent.gravity_m_s2)
    ) @ X + friction(silent, dq)
    moving = (np.abs(dq) > 0.1).all(axis=1)
    assert np.std((measured.torque - needed)[moving]) < 0.1
    assert np.std(measured.torque) > 5.0


def test_over_a_period_the_drives_give_what_friction_takes(silent, excitation):
    measured = move(Plant(silent, "with_human"), excitation, seconds=2.0)
    dq = measured.truth[:, 1]
    given = np.sum(measured.torque * dq) / RATE
    taken = np.sum(friction(silent, dq) * dq) / RATE
    assert_allclose(given, taken, rtol=0.01)


def test_cuff_forces_give_the_torque_on_the_persons_own_leg(silent, excitation):
    plant = Plant(silent, "with_human")
    measured = move(plant, excitation)
    q, dq, ddq = (np.ascontiguousarray(measured.truth[:, i]) for i in range(3))
    own = LEG.regressor(
        q, dq, ddq, Geometry(silent.thigh_length_m, silent.gravity_m_s2)
    ) @ np.array(silent.human_inertial)
    thigh, shank = measured.forces[:, :2].sum(axis=1), measured.forces[:, 2:].sum(axis=1)
    assert_allclose(cuff_torque(thigh, shank, q, plant.geometry), own, atol=1e-9)


def test_a_cuff_presses_and_never_pulls(silent, excitation):
    forces = move(Plant(silent, "with_human"), excitation).forces
    assert (forces[:, [0, 2], 1] < 0).all()
    assert (forces[:, [1, 3], 1] > 0).all()


def test_the_torques_error_has_the_size_and_colour_that_was_asked_for(silent):
    still = np.zeros((40_000, 2))
    loud = silent.model_copy(update={"ripple_nm": (0.6, 0.3), "ripple_correlation_s": 0.02})
    error = Plant(loud, "exo_alone", seed=1).run(still, ~ENABLED).torque
    assert_allclose(error.std(axis=0), [0.6, 0.3], rtol=0.05)
    lag = round(0.02 * RATE)
    assert_allclose(np.corrcoef(error[:-lag, 0], error[lag:, 0])[0, 1], np.exp(-1), atol=0.05)


def test_equal_seeds_give_equal_recordings_and_others_do_not(excitation):
    first, second, other = (
        record(Plant(PlantSettings(), "with_human", seed), excitation, 1.0)[0] for seed in (1, 1, 2)
    )
    assert first.equals(second)
    assert not np.array_equal(first["hip_torque_nm"], other["hip_torque_nm"])


def test_a_plant_goes_on_where_it_stood(silent, excitation):
    reference = excitation.at(np.arange(0, 1, 1 / RATE))[0]
    whole = Plant(silent, "exo_alone").run(reference, ENABLED)
    plant = Plant(silent, "exo_alone")
    parts = [plant.run(reference[k : k + 1], ENABLED) for k in range(len(reference))]
    assert_array_equal(np.concatenate([part.angle for part in parts]), whole.angle)
    assert_array_equal(np.concatenate([part.time for part in parts]), whole.time)


@pytest.mark.parametrize("run", ["exo_alone", "with_human"])
def test_a_recording_by_arrays_keeps_the_contract(excitation, run):
    frame, metadata = record(Plant(PlantSettings(), run), excitation, 2.0)
    RECORDING.check(frame, metadata)
    assert len(frame) == 400
    assert ("shank_back_force_y_n" in frame) == (run == "with_human")


def test_a_recording_begins_where_the_motion_repeats(silent, excitation):
    frame, _ = record(Plant(silent, "with_human"), excitation, 4.0)
    period = round(excitation.period_s * RATE)
    assert_allclose(
        frame["hip_angle_rad"][:period], frame["hip_angle_rad"][period : 2 * period], atol=2e-4
    )


def test_a_disabled_drive_applies_no_torque(silent):
    measured = Plant(silent, "with_human").run(np.full((50, 2), 0.3), ~ENABLED)
    assert_array_equal(measured.torque, 0.0)
    assert_allclose(measured.angle, 0.0, atol=1e-12)


def test_motors_warm_with_the_square_of_their_torque(silent, excitation):
    temperature = move(Plant(silent, "with_human"), excitation).temperature
    assert (temperature[-1] > temperature[0]).all()


def test_a_leg_that_cannot_exist_is_refused():
    with pytest.raises(SettingsError) as caught:
        Plant(PlantSettings(human_inertial=(1.6, -0.41, 1.23, 3.4)), "with_human")
    assert (
        str(caught.value)
        == "plant.exo_inertial + human_inertial: no real leg has these: X2 = -0.19 kg·m² is not"
        " positive: every shank has inertia; correct them"
    )


@pytest.mark.parametrize(
    ("effect", "wanted"),
    [
        (
            PlantEffect(effect="stribeck_friction", joint="hip", values={"stribeck_torque": 2.0}),
            "stribeck_velocity",
        ),
        (PlantEffect(effect="encoder_offset", values={"offset": 0.1}), "expected a joint"),
        (PlantEffect(effect="stribek_friction", joint="hip", values={}), "stribeck_friction"),
    ],
)
def test_an_effect_that_cannot_be_is_refused_with_its_place_in_the_file(effect, wanted):
    with pytest.raises(SettingsError) as caught:
        Plant(PlantSettings(effects=(effect,)), "with_human")
    assert str(caught.value).startswith("plant.effects[0]: ")
    assert wanted in str(caught.value)

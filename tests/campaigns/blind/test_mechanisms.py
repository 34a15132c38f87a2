"""A machine of one joint obeys its one-line equation, in the units that its recording has."""

import json
from typing import NamedTuple

import numpy as np
import pyarrow.parquet as pq
import pytest
from scipy.signal import butter, sosfiltfilt

from tests.campaigns.blind.cases import Case
from tests.campaigns.blind.loop import SAMPLE_S
from tests.campaigns.blind.mechanisms import ONE_JOINT
from tests.campaigns.blind.plan import HIP
from tests.campaigns.blind.session import simulate, write

SEED = 900_200
SPRUNG = 900_201
"""A seed that draws a linear spring."""
SMOOTH = butter(2, 12.0, fs=1.0 / SAMPLE_S, output="sos")
AWAY_S = 0.15
"""How far from a reversal the smoothed torque knows nothing of its step."""


class Motion(NamedTuple):
    """What a recording says, smoothed, away from reversals, (n,) each."""

    q: np.ndarray
    dq: np.ndarray
    ddq: np.ndarray
    torque: np.ndarray


def recorded(session, folder):
    """Write a session, and read its validate run and its truth as anybody would."""
    write(session, folder / "recordings", folder / "truth.json")
    truth = json.loads((folder / "truth.json").read_text())
    (name,) = (run["file"] for run in truth["runs"] if run["purpose"] == "validate")
    table = pq.read_table(folder / "recordings" / name)
    position, force = (
        ("position_m", "force_n")
        if "axis_force_n" in table.column_names
        else ("angle_rad", "torque_nm")
    )
    q, torque = (sosfiltfilt(SMOOTH, table[f"axis_{c}"].to_numpy()) for c in (position, force))
    dq = np.gradient(q, SAMPLE_S)
    kept = away_from_reversals(dq)
    return Motion(*(x[kept] for x in (q, dq, np.gradient(dq, SAMPLE_S), torque))), truth


def away_from_reversals(dq):
    reach = round(AWAY_S / SAMPLE_S)
    slow = np.abs(dq) < 0.1 * np.sqrt(np.mean(dq**2))
    near = np.convolve(slow, np.ones(2 * reach + 1), mode="same") > 0.5
    near[:100] = near[-100:] = True
    return ~near


def terms(session, m):
    """Return what inertia, gravity or weight, Coulomb and viscous friction take: the rig in these
    units."""
    rig, machine = session.rig, session.rig.machine
    torque, angle = rig.units.torque, rig.units.angle
    link = machine.leg.thigh
    inertia = link.mass * link.along**2 + link.inertia + machine.hip_rotor
    return {
        "inertia": torque / angle * inertia * m.ddq,
        "gravity": torque
        * (machine.leg.gravity * link.mass * link.along * np.sin(m.q / angle) + rig.weight),
        "coulomb": torque * machine.coulomb[HIP] * np.sign(m.dq),
        "viscous": torque / angle * machine.viscous[HIP] * m.dq,
    }


def rms(x):
    return np.sqrt(np.mean(x**2))


@pytest.fixture(scope="module", params=ONE_JOINT)
def faultless(request, tmp_path_factory):
    session = simulate(Case(SEED, "none", machine=request.param, kinds=("exo_alone",), plain=True))
    return session, *recorded(session, tmp_path_factory.mktemp(request.param))


def test_a_faultless_machine_obeys_its_equation_to_within_its_noise(faultless):
    session, m, _ = faultless
    parts = terms(session, m)
    noise = session.rig.units.torque * session.rig.machine.ripple[HIP]
    assert rms(m.torque - sum(parts.values())) < noise
    # Each part counts as much as it should: the equation does not hold for want of motion.
    acting = np.column_stack([part for part in parts.values() if part.any()])
    assert acting.shape[1] == (4 if session.mechanism.gravity or session.mechanism.weight else 3)
    assert np.linalg.lstsq(acting, m.torque, rcond=None)[0] == pytest.approx(1.0, abs=0.05)


def test_the_truth_has_the_rig_in_the_units_of_the_recording(faultless):
    session, m, truth = faultless
    parts = terms(session, m)
    (X,) = truth["X"].values()
    inertia, *rest = X
    assert truth["person"] is None
    assert inertia * m.ddq == pytest.approx(parts["inertia"], rel=1e-3)
    if session.mechanism.gravity:
        rest = [rest[0] * session.mechanism.gravity * np.sin(m.q)]
    assert sum(rest) == pytest.approx(parts["gravity"], rel=1e-3)
    assert truth["machine"]["coulomb"][0] * np.sign(m.dq) == pytest.approx(parts["coulomb"])
    assert truth["machine"]["viscous"][0] * m.dq == pytest.approx(parts["viscous"])
    assert list(truth["noise_floor_nm"]) == ["axis"]


def test_a_hidden_linear_spring_has_the_stiffness_that_the_truth_states(tmp_path):
    session = simulate(
        Case(
            SPRUNG,
            "single",
            (("parallel_spring", HIP),),
            machine="slide",
            kinds=("exo_alone",),
            plain=True,
        )
    )
    m, truth = recorded(session, tmp_path)
    parameters = truth["hidden"][0]["parameters"]
    slope, at_zero = np.polyfit(m.q, m.torque - sum(terms(session, m).values()), 1)
    assert slope == pytest.approx(parameters["stiffness"], rel=0.05)
    assert -at_zero / slope == pytest.approx(parameters["rest_angle"], rel=0.05)

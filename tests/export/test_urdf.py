"""pinocchio reads the exported URDF as the machine that exoid identified."""

import numpy as np
import pytest

from pipelines.export import URDF
from tests.export.machines import LEG, machine, named, torque

pinocchio = pytest.importorskip(
    "pinocchio", reason="pinocchio is not installed; `make install` brings it"
)

RELATIVE = 1e-12


def loaded(made):
    model = pinocchio.buildModelFromXML(URDF.write(made, "leg")[".urdf"])
    model.gravity.linear = np.array([0.0, 0.0, -made.geometry.gravity_m_s2])
    return model, model.createData()


def agree(found, expected):
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=RELATIVE * np.abs(expected).max())


def rigid(made):
    """The model without its drives' friction, of which an inverse dynamics of links knows
    nothing."""
    return machine(*(term for term in made.model if term.effect.name != "friction"))


@pytest.mark.parametrize(
    "labels",
    [
        (),
        ("mass_off_axis@hip", "mass_off_axis@knee"),
        ("base_tilt", "encoder_offset@hip"),
        ("encoder_offset@knee",),
    ],
    ids=" ".join,
)
def test_inverse_dynamics_is_ours(labels, states):
    body = type(LEG[0])(LEG[0].effect, np.array([2.6, 0.63, 1.2, 5.7]))
    made = machine(body, *(named(label) for label in labels))
    model, data = loaded(made)
    found = [
        pinocchio.rnea(model, data, *part)
        for part in zip(states.q, states.dq, states.ddq, strict=True)
    ]
    agree(np.array(found), torque(made, states))


def test_the_joint_torque_regressor_is_ours(leg, states):
    model, data = loaded(leg)
    expected = leg.machine.mechanism.regressor(states.q, states.dq, states.ddq, leg.geometry)
    for k in range(len(states.t)):
        theirs = pinocchio.computeJointTorqueRegressor(
            model, data, states.q[k], states.dq[k], states.ddq[k]
        )
        # Ten columns a body, about its joint: mass, three moments, Ixx, Ixy, Iyy, ...; what hangs
        # down has -z.
        (_, thigh_z, thigh_yy), (_, shank_z, shank_yy) = (
            theirs[:, [b, b + 3, b + 6]].T for b in (0, 10)
        )
        agree(np.column_stack([thigh_yy, shank_yy - thigh_yy, -shank_z, -thigh_z]), expected[k])


def test_damping_and_friction_are_the_identified_ones(leg):
    from xml.etree import ElementTree as ET

    root = ET.fromstring(URDF.write(leg, "leg")[".urdf"].encode())
    said = {
        j.get("name"): [float(v) for v in j.find("dynamics").attrib.values()]
        for j in root.iter("joint")
    }
    assert said == {"hip": [4.0, 2.5], "knee": [2.0, 1.5]}

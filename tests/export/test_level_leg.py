"""A planar arm, in every format: a leg whose links lie, about axes that stand, and that no gravity
moves."""

import numpy as np
import pytest

from pipelines.contracts.joints import Joint
from pipelines.contracts.table import Table
from pipelines.effects.baseline import Friction, RigidBody
from pipelines.effects.encoder_offset import EncoderOffset
from pipelines.effects.mass_off_axis import MassOffAxis
from pipelines.effects.parallel_spring import ParallelSpring
from pipelines.export import URDF, exported
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.machine import machine_of
from pipelines.model import Term
from tests.export.machines import acceleration, frame_of, torque
from tests.export.test_mjcf import simulated
from tests.export.test_source_code import few, in_c

NAMES = ("shoulder", "elbow")
LEVEL = Geometry(thigh_length_m=0.41, gravity_m_s2=0.0)
ARM = machine_of([Joint(name) for name in NAMES], LEVEL)
BODY = Term(RigidBody(on=ARM), np.array([2.6, 0.63, 1.1]))
DRIVES = tuple(Term(Friction(name, on=ARM), np.array([0.4, 0.3])) for name in NAMES)
CAUSES = (
    Term(ParallelSpring("elbow", on=ARM), np.array([3.0, -0.6])),
    Term(EncoderOffset("elbow", on=ARM), np.array([0.07])),
    Term(MassOffAxis("elbow", on=ARM), np.array([0.2])),
)


def made_of(*terms):
    metadata = {
        "contract": "parameters/1",
        "mechanism": "leg",
        "geometry": LEVEL.metadata(),
        "joints": [{"name": name, "kind": "revolute"} for name in NAMES],
    }
    return exported(Table(frame_of(terms, "exo_alone", NAMES), metadata))


@pytest.fixture(scope="module")
def arm():
    return made_of(BODY, *DRIVES, *CAUSES)


def agree(found, expected, relative):
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=relative * np.abs(expected).max())


def test_mujoco_moves_it_as_ours_does(arm, states):
    drive = torque(arm, states)
    agree(simulated(arm, states, drive), acceleration(arm, states, drive)[0], 1e-6)
    agree(acceleration(arm, states, drive)[0], states.ddq, 1e-9)


def test_pinocchio_asks_for_the_same_torque_whatever_its_gravity(states):
    pinocchio = pytest.importorskip(
        "pinocchio", reason="pinocchio is not installed; `make install` brings it"
    )
    made = made_of(BODY, *CAUSES[1:])
    model = pinocchio.buildModelFromXML(URDF.write(made, "arm")[".urdf"])
    model.gravity.linear = np.array([0.0, 0.0, -9.81])
    data = model.createData()
    found = [
        pinocchio.rnea(model, data, *row)
        for row in zip(states.q, states.dq, states.ddq, strict=True)
    ]
    agree(np.array(found), torque(made, states), 1e-12)


def test_torque_in_c_is_ours(compiled, arm, states):
    agree(in_c(compiled({"arm": arm}), "arm", states)[0], torque(arm, states), 1e-12)


def test_torque_in_octave_is_ours(in_octave, arm, states):
    agree(in_octave({"arm": arm}, few(states))["arm"]["tau"], torque(arm, few(states)), 1e-12)

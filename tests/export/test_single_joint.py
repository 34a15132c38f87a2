"""Machines of one joint, turning or sliding, with gravity and without, in every format."""

import json
from dataclasses import replace
from xml.etree import ElementTree as ET

import numpy as np
import pandas as pd
import pytest

from pipelines.contracts.table import Table
from pipelines.errors import InputError
from pipelines.export import FORMATS, JSON, MJCF, URDF, exported
from pipelines.mechanics.machine import MECHANISMS
from pipelines.mechanics.mechanisms.single import LIFT, PENDULUM, SLIDE, TURNTABLE
from pipelines.model import model_from_parameters
from tests.export.machines import States, acceleration, torque
from tests.export.test_mjcf import simulated
from tests.export.test_source_code import in_c

SINGLES = {"pendulum": PENDULUM, "turntable": TURNTABLE, "lift": LIFT, "slide": SLIDE}
X = {"pendulum": (0.17, 0.34), "turntable": (0.4,), "lift": (12.0, 70.0), "slide": (95.0,)}
CAUSES = {
    "friction": {"coulomb": 0.5, "viscous": 0.3},
    "parallel_spring": {"stiffness": 3.0, "rest_angle": 0.2},
    "quadratic_drag": {"drag": 0.4},
    "encoder_offset": {"offset": 0.07},
}
ONLY_OF = {"pendulum": {"mass_off_axis": {"mass_moment": 0.05}}}
NAME = "my axis"

each = pytest.mark.parametrize("kind", SINGLES)


def single(kind, *, causes=CAUSES, times=1.0):
    """Return a machine as its file tells of it, every cause in it that MJCF holds, its X so many
    times as large."""
    mechanism = SINGLES[kind]
    body = [times * value for value in X[kind]]
    given = {"rigid_body": dict(zip([p.name for p in mechanism.parameters], body, strict=True))}
    given |= causes | (ONLY_OF.get(kind, {}) if causes is CAUSES else {})
    rows = [
        {
            "name": name,
            "symbol": name,
            "joint": None if effect == "rigid_body" else NAME,
            "value": value,
            "unit": "1",
            "run": "exo_alone" if effect == "rigid_body" else None,
            "effect": effect,
        }
        for effect, values in given.items()
        for name, value in values.items()
    ]
    metadata = {
        "joints": [{"name": NAME, "kind": mechanism.kinds[0]}],
        "geometry": {"gravity_m_s2": 9.81 if mechanism.has_gravity else 0.0},
    }
    return exported(Table(pd.DataFrame(rows), metadata))


@pytest.fixture(scope="module")
def instants():
    random = np.random.default_rng(8)
    speed = random.uniform(0.5, 2.0, (30, 1)) * random.choice([-1.0, 1.0], (30, 1))
    return States(
        random.uniform(0, 9, 30),
        random.uniform(-1, 1, (30, 1)),
        speed,
        random.uniform(-8, 8, (30, 1)),
    )


def agree(found, expected, relative):
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=relative * np.abs(expected).max())


def test_every_mechanism_is_tried():
    assert {*SINGLES.values()} == {
        mechanism for mechanism in MECHANISMS if len(mechanism.kinds) == 1
    }


@each
def test_mujoco_swings_its_link_behind_a_soft_joint_as_ours_does(kind, instants):
    """What stays with the motor goes with the machine's own inertia, not with an exoskeleton's."""
    soft = {
        "friction": {"coulomb": 0.0, "viscous": 0.3},
        "joint_elasticity": {"stiffness": 90.0, "hardening": 0.0},
    }
    made = single(kind, causes=soft)
    random = np.random.default_rng(5)
    twist, drive = random.uniform(-0.05, 0.05, (30, 1)), random.uniform(-3.0, 3.0, (30, 1))
    motor, link = acceleration(made, instants, drive, twist)
    found = simulated(made, instants, drive, [(f"{NAME}_twist", -twist[:, 0])])
    agree(found[:, :1], motor, 1e-6)
    agree(found.sum(axis=1, keepdims=True), link, 1e-6)


@each
def test_mujoco_moves_it_as_ours_does(kind, instants):
    made = single(kind)
    drive = torque(made, instants)
    agree(simulated(made, instants, drive), acceleration(made, instants, drive)[0], 1e-6)
    agree(acceleration(made, instants, drive)[0], instants.ddq, 1e-9)


@each
def test_pinocchio_asks_for_the_same_torque(kind, instants):
    pinocchio = pytest.importorskip(
        "pinocchio", reason="pinocchio is not installed; `make install` brings it"
    )
    made = single(kind, causes={"encoder_offset": {"offset": 0.07}})
    text = URDF.write(made, "machine")[".urdf"]
    model = pinocchio.buildModelFromXML(text)
    told = float(text.split("Set gravity in the reader: ")[1].split()[0])
    model.gravity.linear = np.array([0.0, 0.0, -told])
    data = model.createData()
    found = [
        pinocchio.rnea(model, data, *row)
        for row in zip(instants.q, instants.dq, instants.ddq, strict=True)
    ]
    agree(np.array(found), torque(made, instants), 1e-12)


def test_torque_in_c_is_ours(compiled, instants):
    library = compiled({kind: single(kind) for kind in SINGLES})
    for kind in SINGLES:
        tau, _, M = in_c(library, kind, instants)
        agree(tau, torque(single(kind), instants), 1e-12)
        agree(M[:, 0, 0], np.full(30, X[kind][0]), 1e-12)


def test_torque_in_octave_is_ours(in_octave, instants):
    for kind, found in in_octave({kind: single(kind) for kind in SINGLES}, instants).items():
        agree(found["tau"], torque(single(kind), instants), 1e-12)


@each
def test_torque_from_json_is_that_of_the_model(kind, instants):
    made = single(kind)
    said = json.loads(JSON.write(made, "machine")[".json"])
    model = model_from_parameters(pd.DataFrame(said["parameters"]), said["run"], made.machine)
    np.testing.assert_array_equal(
        torque(replace(made, model=model), instants), torque(made, instants)
    )


@each
def test_units_are_those_of_the_joint(kind):
    """A slide's friction is in newtons, wherever a file tells it."""
    said = json.loads(JSON.write(single(kind), "machine")[".json"])
    (friction,) = (effect for effect in said["effects"] if effect["effect"] == "friction")
    unit = {"revolute": "N·m", "prismatic": "N"}[said["joints"][0]["kind"]]
    assert friction["values"][0]["unit"] == said["joints"][0]["torque_unit"] == unit


def test_what_slides_is_no_hinge():
    for kind, joint, urdf in (("lift", "slide", "prismatic"), ("pendulum", "hinge", "revolute")):
        made = single(kind)
        assert (
            ET.fromstring(MJCF.write(made, "m")[".xml"].encode()).find(".//joint").get("type")
            == joint
        )
        assert (
            ET.fromstring(URDF.write(made, "m")[".urdf"].encode()).find(".//joint").get("type")
            == urdf
        )


def test_a_cause_that_such_a_machine_cannot_have_is_said_to_be_left_out():
    """A turntable's mass off its axis weighs nothing: no equation holds it, and no format claims
    to."""
    made = single("turntable", causes={"mass_off_axis": {"mass_moment": 0.05}})
    for format in FORMATS:
        ((_, holding),) = [
            (t, h) for t, h in made.holdings(format) if t.effect.name == "mass_off_axis"
        ]
        assert (
            holding.degree == "left out" and holding.how == "a machine of this kind cannot have it"
        )


@each
def test_a_body_of_negative_inertia_is_refused_as_no_machine_of_its_kind(kind):
    with pytest.raises(
        InputError,
        match=r"not those of a real machine: X1 = -.* with the signs of torque and angle as they",
    ):
        single(kind, times=-1.0)


def test_play_is_held_by_json_and_listed_by_what_has_no_element_for_it():
    """Only a simulation needs teeth: no format but MuJoCo's simulates, and that has no play."""
    made = single("pendulum", causes={"friction": CAUSES["friction"], "backlash": {"play": 0.012}})
    for format in FORMATS:
        ((_, holding),) = [(t, h) for t, h in made.holdings(format) if t.effect.name == "backlash"]
        text = "\n".join(format.write(made, "arm").values())
        assert (holding.degree == "exactly") == (format is JSON)
        assert "0.012" in text and (format is JSON or f"left out ({holding.how})" in text)


@pytest.mark.parametrize(
    ("kind", "times"), [*((kind, 0.0) for kind in SINGLES), ("pendulum", 1e-300)]
)
def test_a_body_without_mass_is_refused_in_a_line(kind, times):
    with pytest.raises(
        InputError, match=r"exo_alone parameters are not those of a real machine: .* identify again"
    ):
        single(kind, times=times)

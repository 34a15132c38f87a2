"""URDF, as pinocchio, ROS and MATLAB's Robotics System Toolbox read it.

A leg moves in the x-z plane, x forward and z up; its joints turn about -y, so that forward is
positive. A joint's position is its encoder's angle. URDF has neither gravity nor rotors.
"""

from collections.abc import Mapping
from math import pi
from xml.etree import ElementTree as ET

import numpy as np

from pipelines.effects import Element
from pipelines.export.bodies import NOMINAL, Body, bodies
from pipelines.export.exported import ExportedModel
from pipelines.export.format import Degree, Format, Holding, exact
from pipelines.export.holding import held_friction, holding_from
from pipelines.export.language import one_line, unique
from pipelines.export.xml_text import document, number, numbers
from pipelines.model import Term


def _friction(term: Term) -> Holding:
    how = "dynamics of the joint: damping and friction; some readers ignore them"
    return held_friction(term, exact(how))


def _write(exported: ExportedModel, stem: str) -> Mapping[str, str]:
    """Return the model's text."""
    root = ET.Element("robot", name=one_line(stem))
    joints = unique(one_line(joint.name) for joint in exported.joints)
    links = unique([f"{name}_link" for name in joints], ["base", *joints])
    ET.SubElement(root, "link", name="base")
    parent = "base"
    machine_bodies = bodies(exported)
    for name, link, body in zip(joints, links, machine_bodies, strict=True):
        _link(root, link, body)
        _joint(root, name, parent, link, body, exported)
        parent = link
    # A counterweight carries part of a lift's weight, so gravity is reduced.
    gravity = number(exported.geometry.gravity_m_s2 * (1.0 - machine_bodies[0].carried))
    comments = [
        f"{NOMINAL} Limits are not the machine's.",
        f"Set gravity in the reader: {gravity} m/s² along -z.",
    ]
    return {".urdf": document(root, [*exported.heading(URDF), "", *comments])}


def _link(root: ET.Element, name: str, body: Body) -> None:
    inertial = ET.SubElement(ET.SubElement(root, "link", name=name), "inertial")
    ET.SubElement(inertial, "origin", xyz=numbers(*body.centre), rpy="0 0 0")
    ET.SubElement(inertial, "mass", value=number(body.mass))
    same, none = number(body.inertia), "0"
    ET.SubElement(inertial, "inertia", ixx=same, iyy=same, izz=same, ixy=none, ixz=none, iyz=none)


def _joint(
    root: ET.Element, name: str, parent: str, link: str, body: Body, exported: ExportedModel
) -> None:
    joint = ET.SubElement(root, "joint", name=name, type=body.joint.kind)
    # Set back by the encoder's shift.
    back, turns = -body.shift * np.array(body.axis), body.joint.kind == "revolute"
    # Axes are coordinate axes: the rotation's vector is then its roll, pitch and yaw.
    place, turned = (body.place, back) if turns else (back, np.zeros(3))
    ET.SubElement(joint, "origin", xyz=numbers(*place), rpy=numbers(*turned))
    ET.SubElement(joint, "parent", link=parent)
    ET.SubElement(joint, "child", link=link)
    ET.SubElement(joint, "axis", xyz=numbers(*body.axis))
    # URDF requires limits, and the model has none.
    ET.SubElement(joint, "limit", lower=number(-pi), upper=number(pi), effort="1e6", velocity="1e3")
    friction = exported.of(Element.FRICTION, body.joint.name)
    if friction and _friction(friction).degree is not Degree.NOT:
        # Negative values are refused by readers; `held_friction` states the loss.
        coulomb, viscous = np.maximum(friction.values, 0.0)
        ET.SubElement(joint, "dynamics", damping=number(viscous), friction=number(coulomb))


URDF = Format(
    "urdf",
    "URDF model",
    ".urdf",
    holding_from(
        {
            Element.RIGID_BODIES: "links of nominal masses that have these X",
            Element.MASS_ACROSS: "place of the link's centre of mass",
        },
        _friction,
        "origin of the joint",
        "URDF",
    ),
    _write,
)

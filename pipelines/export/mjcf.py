"""MJCF: MuJoCo's model format.

A leg moves in the x-z plane, x forward and z up; its joints turn about -y, so that forward is
positive. A joint's ``qpos`` is its encoder's angle, an actuator's ``ctrl`` the reading of its
torque channel.
"""

from collections.abc import Mapping
from xml.etree import ElementTree as ET

import numpy as np

from pipelines.contracts import Joint
from pipelines.dynamics.assembly import motor_inertia
from pipelines.effects import Element
from pipelines.export.bodies import NOMINAL, Body, bodies
from pipelines.export.exported import ExportedModel
from pipelines.export.format import Degree, Format, Holding, approximate
from pipelines.export.holding import held_friction, holding_from
from pipelines.export.language import one_line, unique
from pipelines.export.xml_text import document, number, numbers
from pipelines.model import Term

TIMESTEP_S = 0.001


def _friction(term: Term) -> Holding:
    how = "joint damping and frictionloss: exact in motion, but standing joints creep a little"
    return held_friction(term, approximate(how))


def _write(exported: ExportedModel, stem: str) -> Mapping[str, str]:
    """Return the model's text."""
    root = ET.Element("mujoco", model=one_line(stem))
    ET.SubElement(root, "compiler", angle="radian")
    gravity = numbers(0.0, 0.0, -exported.geometry.gravity_m_s2)
    # implicitfast treats damping implicitly: strong viscous friction stays stable at this step.
    ET.SubElement(
        root, "option", gravity=gravity, timestep=number(TIMESTEP_S), integrator="implicitfast"
    )
    world = ET.SubElement(root, "worldbody")
    names = unique(one_line(joint.name) for joint in exported.joints)
    twists = unique([f"{name}_twist" for name in names], names)
    parent = world
    for name, twist, body in zip(names, twists, bodies(exported), strict=True):
        parent = _body(parent, name, twist, body, exported)
    springs = ET.Element("tendon")
    actuators = ET.Element("actuator")
    for name, twist, joint in zip(names, twists, exported.joints, strict=True):
        _spring_across(springs, (name, twist), joint, exported)
        _actuator(actuators, name, joint, exported)
    root.extend([part for part in (springs, actuators) if len(part)])
    masses = f"{NOMINAL} Shapes are for display only."
    return {".xml": document(root, [*exported.heading(MJCF), "", masses])}


def _body(
    parent: ET.Element, name: str, twist: str, body: Body, exported: ExportedModel
) -> ET.Element:
    element = ET.SubElement(parent, "body", {"name": f"{name}_link"} | _frame(body))
    kind = "hinge" if body.joint.kind == "revolute" else "slide"
    hinge = {"type": kind, "axis": numbers(*body.axis)}
    soft = _twist(body.joint, exported)
    at_link = {} if soft else _spring(body.joint, body.shift, exported)
    ET.SubElement(element, "joint", {"name": name} | hinge | _joint(body, exported) | at_link)
    if soft:
        ET.SubElement(element, "joint", {"name": twist} | hinge | soft)
    inertia = numbers(*[body.inertia] * 3)
    centre = body.centre
    if soft and kind == "slide":
        # MuJoCo treats two slides of a body centred at their frame as independent. A shift by 1 cm
        # has no effect on the motion of a slide.
        centre = centre + np.array([0.01, 0.0, 0.0])
    ET.SubElement(
        element, "inertial", pos=numbers(*centre), mass=number(body.mass), diaginertia=inertia
    )
    end = numbers(0.0, 0.0, 0.0, *(exported.geometry.thigh_length_m * np.array(body.lies)))
    # No contacts: the shapes are nominal, and links that touch would add forces.
    ET.SubElement(
        element, "geom", type="capsule", size="0.03", fromto=end, contype="0", conaffinity="0"
    )
    return element


def _frame(body: Body) -> dict[str, str]:
    """Return the joint's frame, set back by the encoder's shift."""
    carried = {"gravcomp": number(body.carried)} if body.carried else {}
    axis = np.array(body.axis)
    if body.joint.kind == "prismatic":
        return {"pos": numbers(*(-body.shift * axis))} | carried
    # A rotation by minus the shift, so that the joint's own angle is the encoder's reading.
    quat = numbers(np.cos(0.5 * body.shift), *(-np.sin(0.5 * body.shift) * axis))
    return {"pos": numbers(*body.place), "quat": quat} | carried


def _joint(body: Body, exported: ExportedModel) -> dict[str, str]:
    """Return friction and rotor inertia of a drive as attributes of its joint."""
    name, attributes = body.joint.name, {}
    damping = [0.0, 0.0]
    friction = exported.of(Element.FRICTION, name)
    drag = exported.of(Element.QUADRATIC_DAMPING, name)
    if friction and _friction(friction).degree is not Degree.NOT:
        # MuJoCo refuses negative values; `held_friction` states the loss.
        coulomb, damping[0] = np.maximum(friction.values, 0.0)
        attributes["frictionloss"] = number(coulomb)
        # Two steps are the shortest time constant that MuJoCo allows.
        attributes["solreffriction"] = numbers(2.0 * TIMESTEP_S, 1.0)
    if drag:
        damping[1] = drag.values[0]
    if any(damping):
        attributes["damping"] = numbers(*damping) if damping[1] else number(damping[0])
    rotor, soft = exported.of(Element.ARMATURE, name), exported.of(Element.SERIES_SPRING, name)
    armature = rotor.values[0] if rotor else 0.0
    if soft:
        # Behind a spring the motor moves apart from the link, so its own joint needs an inertia.
        armature += motor_inertia(soft.effect, exported.model, exported.geometry)
    return attributes | ({"armature": number(armature)} if armature else {})


def _spring(joint: Joint, shift: float, exported: ExportedModel) -> dict[str, str]:
    spring = exported.of(Element.SPRING, joint.name)
    if spring is None:
        return {}
    stiffness, rest = spring.effect.physical(spring.values)
    return {"stiffness": number(stiffness), "springref": number(rest + shift)}


def _twist(joint: Joint, exported: ExportedModel) -> dict[str, str]:
    """Return the joint between motor and link, whose angle is minus the transmission's twist."""
    soft = exported.of(Element.SERIES_SPRING, joint.name)
    if soft is None:
        return {}
    stiffness, hardening = soft.values
    # Coefficients of 1, twist and twist² of the stiffness k (1 + h twist²).
    text = numbers(stiffness, 0.0, stiffness * hardening) if hardening else number(stiffness)
    damping = 2.0 * soft.effect.damping_ratio * np.sqrt(stiffness * soft.effect.motor_inertia)
    return {"stiffness": text, "damping": number(damping)}


def _spring_across(
    springs: ET.Element, names: tuple[str, str], joint: Joint, exported: ExportedModel
) -> None:
    """Add the spring of a link behind an elastic joint, whose angle is a sum of two."""
    if exported.of(Element.SERIES_SPRING, joint.name) is None:
        return
    place = [other.name for other in exported.joints].index(joint.name)
    spring = _spring(joint, exported.shift()[place], exported)
    if spring:
        stated = {"stiffness": spring["stiffness"], "springlength": spring["springref"]}
        across = ET.SubElement(springs, "fixed", {"name": f"{names[0]}_spring"} | stated)
        for part in names:
            ET.SubElement(across, "joint", joint=part, coef="1")


def _actuator(actuators: ET.Element, name: str, joint: Joint, exported: ExportedModel) -> None:
    gain = exported.of(Element.TORQUE_GAIN, joint.name)
    offset = exported.of(Element.TORQUE_OFFSET, joint.name)
    if gain is None and offset is None:
        ET.SubElement(actuators, "motor", name=name, joint=name)
        return
    # The channel reads g T or g T + o; for a command u the drive delivers the T that reads u.
    per_unit = 1.0 / (gain.values[0] if gain else 1.0)
    # Solved for T: the order of gain and offset decides whether the offset is scaled, too.
    at_zero = -(offset.values[0] if offset else 0.0)
    first = next(term for term in exported.terms if term is gain or term is offset)
    if offset and first is gain:
        at_zero *= per_unit
    bias = numbers(at_zero, 0.0, 0.0)
    general = {"gainprm": number(per_unit), "biastype": "affine", "biasprm": bias}
    ET.SubElement(actuators, "general", {"name": name, "joint": name} | general)


MJCF = Format(
    "mjcf",
    "MuJoCo model",
    ".xml",
    holding_from(
        {
            Element.RIGID_BODIES: "bodies of nominal masses that have these X",
            Element.QUADRATIC_DAMPING: (
                "second coefficient of the joint's damping (read by MuJoCo 4.0)"
            ),
            Element.ARMATURE: "joint armature",
            Element.SPRING: "joint stiffness and springref",
            Element.MASS_ACROSS: "place of the body's centre of mass",
            Element.SERIES_SPRING: (
                "a second joint, its stiffness and damping; the motor's inertia is the first one's"
                " armature"
            ),
            Element.TORQUE_GAIN: "gain of the actuator",
            Element.TORQUE_OFFSET: "bias of the actuator",
        },
        _friction,
        "orientation of the joint's frame",
        "MJCF",
    ),
    _write,
)

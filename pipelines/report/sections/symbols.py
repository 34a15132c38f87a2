"""Meaning, unit and equation of the symbols of a model's parameters, from the effects."""

from typing import Any

from pipelines.contracts import Joint
from pipelines.effects import Effect, Parameter
from pipelines.effects.baseline import Friction, RigidBody
from pipelines.errors import InputError
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.machine import Machine, machine_of
from pipelines.model import effect_named
from pipelines.report.session import Session


def terms(session: Session) -> list[dict[str, Any]]:
    """Return title, equation and parameters of each known effect in a session's models."""
    results: dict[str, dict[str, Any]] = {}
    for one in session.of_kind("parameters"):
        for row in session.table(one).frame[["effect", "joint"]].to_dict("records"):
            name, joint = row["effect"], row["joint"] if isinstance(row["joint"], str) else None
            effect = _bound(session, name, joint)
            if effect and name not in results:
                about = {"title": effect.title, "equation": effect.equation}
                results[name] = about | {"parameters": _parameters(effect)}
    return list(results.values())


def meaning(session: Session, effect: str, joint: str, name: str) -> str:
    """Return a parameter's meaning; empty for an unknown effect."""
    return next((one.meaning for one in _parameters_of(session, effect, joint or None, name)), "")


def unit(session: Session, key: str) -> str:
    """Return the unit of a parameter by its key in a trajectory file, such as ``hip_viscous``."""
    # Keys of a trajectory join joint and parameter; those without a joint are of the rigid body.
    joint = next((one for one in session.joints if key.startswith(f"{one.name}_")), None)
    if joint:
        named = _parameters_of(
            session, Friction.name, joint.name, key.removeprefix(f"{joint.name}_")
        )
    else:
        named = _parameters_of(session, RigidBody.name, None, key)
    return next((one.unit for one in named), "")


def _parameters_of(
    session: Session, effect_name: str, joint: str | None, name: str
) -> list[Parameter]:
    effect = _bound(session, effect_name, joint)
    return [one for one in _parameters(effect) if one.name == name] if effect else []


def _parameters(effect: Effect) -> list[Parameter]:
    """Return an effect's parameters, in the units of its joint."""
    return [one.at(effect.on, effect.joint) if effect.joint else one for one in effect.parameters]


def _bound(session: Session, name: str, joint: str | None) -> Effect | None:
    """Return an effect at a joint of the session's machine; None for an unknown one."""
    try:
        return effect_named(name)(joint=joint, on=_machine(session.joints, session))
    except InputError:
        return None


def _machine(joints: tuple[Joint, ...], session: Session) -> Machine:
    geometries = (one.metadata.get("geometry") for one in session.of_kind("parameters"))
    geometry = next((one for one in geometries if isinstance(one, dict)), {})
    # Files may hold further keys, which Geometry does not take.
    known = {key: geometry[key] for key in ("thigh_length_m", "gravity_m_s2") if key in geometry}
    return machine_of(joints, Geometry(**known))

"""What the symbols of a model's parameters stand for: each term with its equation, as the effects
themselves say."""

from dataclasses import dataclass

from pipelines.contracts import Joint
from pipelines.effects import Effect, Parameter
from pipelines.errors import InputError
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.machine import Machine, machine_of
from pipelines.model import effect_named
from pipelines.report.session import Session


@dataclass(frozen=True)
class Explained:
    """One term of the models."""

    title: str
    equation: str
    parameters: tuple[Parameter, ...]


def terms(session: Session) -> list[Explained]:
    """Return every kind of term in a session's models, once; of effects that are not known here,
    none."""
    rows = [
        (row["effect"], row["joint"] if isinstance(row["joint"], str) else None)
        for one in session.of_kind("parameters")
        for row in session.table(one).frame[["effect", "joint"]].to_dict("records")
    ]
    results: dict[str, Explained] = {}
    for name, joint in rows:
        effect = bound(session, name, joint)
        if effect and name not in results:
            results[name] = Explained(effect.title, effect.equation, parameters(effect))
    return list(results.values())


def meaning(session: Session, effect: str, joint: str, name: str) -> str:
    """Return what one parameter is, as its effect says; nothing where the effect is not known
    here."""
    of = bound(session, effect, joint or None)
    return next((one.meaning for one in parameters(of) if one.name == name), "") if of else ""


def unit(session: Session, key: str) -> str:
    """Return the unit of a parameter of rigid body or friction by its name in an excitation's file:
    ``hip_viscous``."""
    joint = next((one for one in session.joints if key.startswith(f"{one.name}_")), None)
    of = bound(session, "friction" if joint else "rigid_body", joint.name if joint else None)
    name = key.removeprefix(f"{joint.name}_") if joint else key
    return next((one.unit for one in parameters(of) if one.name == name), "") if of else ""


def parameters(effect: Effect) -> tuple[Parameter, ...]:
    """Return an effect's parameters in the units of the joint that it is at."""
    return tuple(
        one.at(effect.on, effect.joint) if effect.joint else one for one in effect.parameters
    )


def bound(session: Session, name: str, joint: str | None) -> Effect | None:
    """Return an effect at a joint of the session's machine; None where there is no such effect or
    machine here."""
    try:
        return effect_named(name)(joint=joint, on=_machine(session.joints, session))
    except InputError:
        return None


def _machine(joints: tuple[Joint, ...], session: Session) -> Machine:
    geometries = (one.metadata.get("geometry") for one in session.of_kind("parameters"))
    geometry = next((one for one in geometries if isinstance(one, dict)), {})
    known = {key: geometry[key] for key in ("thigh_length_m", "gravity_m_s2") if key in geometry}
    return machine_of(joints, Geometry(**known))

"""An unlisted law's label, ``law:angle@hip``, its family, and its wording."""

from pipelines.contracts.joints import the
from pipelines.mechanics.machine import Machine

LAW = "law:"
"""Prefix of the label of an unlisted law."""
UNLISTED = "unlisted_"
"""Prefix of the kind of an unlisted effect that resembles a listed cause, before its family."""
ACROSS_JOINTS = "across_joints"
"""The kind that acts at both joints at once, so that its label has no joint."""
LAWS = {
    "angle": ("angle", "a law of {joint}'s angle"),
    "other_angle": ("angle", "a law of the other joint's angle at {joint}"),
    "both_angles": ("angle", "a law of both joints' angles at {joint}"),
    "friction_by_angle": ("angle", "friction of {joint} that depends on its angle"),
    "friction_by_other_angle": (
        "angle",
        "friction of {joint} that depends on the other joint's angle",
    ),
    "speed": ("speed", "a law of {joint}'s speed"),
    "other_speed": ("speed", "a law of the other joint's speed at {joint}"),
    "load": ("load", "a law of {joint}'s load"),
    "other_load": ("load", "a law of the other joint's load at {joint}"),
    "inertia_by_angle": ("transmission", "an inertia of {joint} that depends on its angle"),
    "gain_over_time": ("time", "a torque gain of {joint} that changes with time"),
    "friction_over_time": ("time", "friction of {joint} that changes with time"),
    "time": ("time", "a torque of {joint} that wanders in time and does not repeat"),
    "hum": ("time", "a tone at {joint} that does not follow the motion"),
    "bursts": ("time", "a torque at {joint} that comes in bursts and does not repeat"),
    ACROSS_JOINTS: ("angle", "an elastic torque across both joints"),
    "quantisation": ("sensor", "a torque of {joint} that is reported in coarse steps"),
}
"""Family and wording of each kind of smooth law."""


def law_label(kind: str, joint: str | None, wearer: str = "all") -> str:
    """Return a law's label, ``law:angle@hip``; it ends in ``/human`` if it is the wearer's."""
    return LAW + kind + (f"@{joint}" if joint else "") + ("" if wearer == "all" else f"/{wearer}")


def kind_and_joint(label: str) -> tuple[str, str | None]:
    """Return a law's kind, and its joint; None where it is of no single joint."""
    kind, _, joint = label.removeprefix(LAW).partition("/")[0].partition("@")
    return kind, joint or None


def family_of_kind(kind: str) -> str:
    """Return the family that a kind of law belongs to."""
    return kind.removeprefix(UNLISTED) if kind.startswith(UNLISTED) else LAWS[kind][0]


def law_in_words(label: str, machine: Machine | None = None) -> str:
    """Return a law's wording; a machine's sliding joints have positions and forces."""
    kind, joint = kind_and_joint(label)
    if kind.startswith(UNLISTED):
        return f"{family_in_words(family_of_kind(kind), joint, machine)}, similar to a listed cause"
    return _said_of(LAWS[kind][1], joint, machine)


def is_of_other_joint(label: str) -> bool:
    """Return whether a law depends on the other joint's motion."""
    return "other" in kind_and_joint(label)[0].split("_")


def family_in_words(
    family: str, joint: str | None, machine: Machine | None = None, *, of_other_joint: bool = False
) -> str:
    """Return the wording of a missing effect, by its family and its joint, if it has one."""
    # Where the likely law is of the other joint.
    of_other = {
        "angle": "a torque at {joint} that depends on the other joint's angle",
        "speed": "a torque at {joint} that depends on the other joint's speed",
        "load": "a torque at {joint} that depends on the other joint's load",
    }
    of_several = {"angle": "a law of {joint}'s angles"}
    special = of_several if not joint else of_other if of_other_joint else {}
    families = {
        "angle": "a law of {joint}'s angle",
        "speed": "a law of {joint}'s speed",
        "reversal": "friction of {joint} that remembers its reversals",
        "load": "a law of {joint}'s load",
        "time": "a torque at {joint} that changes with time",
        "transmission": "something in {joint}'s transmission",
        "sensor": "something in {joint}'s sensors",
        "person": "something of the person at {joint}",
    }
    return _said_of(special.get(family, families[family]), joint, machine)


def _said_of(words: str, joint: str | None, machine: Machine | None) -> str:
    """Return a wording for a joint or the machine; a sliding joint has a position and a force."""
    if joint and machine is not None:
        own = machine.joint(joint)
        # LAWS are worded for a joint that turns.
        words = words.replace("angle", own.place).replace("torque", own.effort)
    return words.format(joint=the(joint) if joint else "the machine")

"""Ensure that runs that are fitted together are of one machine."""

from collections.abc import Sequence

from pipelines.errors import InputError
from pipelines.mechanics.run import Run


def refuse_several_machines(motions: Sequence[Run]) -> None:
    """Refuse motions whose joints or geometry differ from the first one's.

    Parameters
    ----------
    motions : sequence of Run
        At least one.

    Raises
    ------
    InputError
        Names both files and their joints or lengths.
    """
    first = motions[0]
    for other in motions[1:]:
        if other.machine.joints != first.machine.joints:
            raise InputError(
                f"{other.file} has joints {_named(other)}, {first.file} has {_named(first)}; give"
                " runs of one machine"
            )
        # The regressor contains only these. Cuff distances may differ, as each run uses its own.
        lengths = ("thigh_length_m",) if first.machine.mechanism.has_length else ()
        for key in (*lengths, "gravity_m_s2"):
            ours, theirs = getattr(first.geometry, key), getattr(other.geometry, key)
            if ours != theirs:
                raise InputError(
                    f"{other.file} has {key} {theirs:g}, {first.file} has {ours:g}; give runs of"
                    " one machine, or correct the metadata"
                )


def _named(run: Run) -> str:
    joints = run.machine.joints
    alike = all(joint.kind == "revolute" for joint in joints)
    return ", ".join(joint.name if alike else f"{joint.name} ({joint.kind})" for joint in joints)

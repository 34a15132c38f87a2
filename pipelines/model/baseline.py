"""The baseline model: rigid bodies and friction."""

from collections.abc import Collection, Iterable

from pipelines.effects import Effect
from pipelines.effects.baseline import ForceSensorZero, Friction, RigidBody
from pipelines.mechanics.machine import Machine

BASELINE = (RigidBody.name, Friction.name)


def baseline(
    machine: Machine,
    kinds: Collection[str],
    known: Iterable[Effect] = (),
    *,
    cuffs: bool = False,
) -> tuple[Effect, ...]:
    """Return the effects that every model starts with.

    The machine and its wearer have a rigid body each if the data separate them: by runs with and
    without the wearer, or by cuff forces. With one kind of run and no cuff forces, one body stands
    for both.

    Parameters
    ----------
    machine : Machine
        The machine that has the effects.
    kinds : collection of str
        Kinds of run to be explained.
    known : iterable of Effect
        Further effects that the machine is known to have, without shape parameters to be fitted.
    cuffs : bool
        Whether cuff forces are fitted; their sensors then have zeros.
    """
    # Friction shows in its own joint's torque alone, so it needs a measured one.
    # Without such data, both bodies would have the same columns.
    wearer = [RigidBody(run="with_human", on=machine)] * (len(kinds) == 2 or cuffs)
    friction = (Friction(joint=joint, on=machine) for joint in machine.measured_names)
    zeros = [ForceSensorZero(on=machine)] * cuffs
    return (RigidBody(on=machine), *wearer, *friction, *known, *zeros)

"""Describe causes that data of a kind can never separate, why, and how to separate them."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Tie:
    """Why two causes look alike, and how to separate them."""

    why: str
    how_to_separate: str


STRUCTURAL: dict[frozenset[str], Tie] = {
    frozenset({"torque_offset", "coulomb_asymmetry"}): Tie(
        "while the joint always moves, a friction that differs with direction adds the same"
        " constant torque",
        "hold the joint still and read the torque with the drive off: an offset of the sensor"
        " stays",
    ),
    frozenset({"base_tilt", "encoder_offset"}): Tie(
        "a tilted base turns gravity just as a first encoder with a shifted zero does",
        "put a spirit level on the base, or let the machine hang freely and read its first angle",
    ),
    frozenset({"encoder_offset", "mass_off_axis"}): Tie(
        "under one load a shifted zero and a mass off the axis turn gravity alike",
        "record with another load as well, a person or a known weight: an offset is one angle in"
        " both, a mass is not",
    ),
    frozenset({"base_tilt", "mass_off_axis"}): Tie(
        "under one load a tilted base and a mass off the axis turn gravity alike",
        "record with another load as well, a person or a known weight, or put a spirit level on the"
        " base",
    ),
    frozenset({"torque_gain"}): Tie(
        "without another measurement of the load only the ratio of both gains shows: one too high"
        " looks like the other too low",
        "hang a known weight on each joint in turn; or record the cuff forces, with and without the"
        " person",
    ),
    frozenset({"backlash", "encoder_offset"}): Tie(
        "while the load pushes to one side only, play shifts the angle by a constant half of it",
        "move the joint through angles where the load changes sign, or shake the link by hand",
    ),
    frozenset({"parallel_spring", "torque_offset"}): Tie(
        "a soft spring that is far wound up adds little but a constant torque",
        "let the joint rest with the drive off, and unhook the spring: an offset of the sensor"
        " stays",
    ),
    frozenset({"parallel_spring", "coulomb_asymmetry"}): Tie(
        "a soft spring that is far wound up adds little but a constant torque. While the joint"
        " always moves, friction that differs with direction does the same",
        "unhook the spring, or let the joint rest: friction holds it, a spring moves it",
    ),
    frozenset({"friction_temperature", "friction_warmup"}): Tie(
        "while a run warms steadily, its temperature and its time rise together",
        "repeat the motion with the drive warm: friction that follows the temperature is low from"
        " the start",
    ),
    frozenset({"encoder_eccentricity", "encoder_offset"}): Tie(
        "over less than half a turn an error once a turn is nearly a constant and a scale of the"
        " angle",
        "turn the joint to marks of known angle all the way round, and read the encoder",
    ),
    frozenset({"end_stop", "passive_joint_torque"}): Tie(
        "with the person in every run, a stop of the machine and one of the person's joint are"
        " alike",
        "record the machine with nobody in it through the same range",
    ),
    frozenset({"torque_drift", "torque_offset"}): Tie(
        "over runs this short a drift is an offset that differs from run to run",
        "record longer, or read the torque at rest before and after each run",
    ),
}


def tie_between(named: str, other: str, confirm_named: str, confirm_other: str) -> Tie:
    """Return why two effects are not separated, for any data or on this motion only.

    Parameters
    ----------
    named, other : str
        Names of the effects, without joints.
    confirm_named, confirm_other : str
        Their experiments.
    """
    structural = STRUCTURAL.get(frozenset({named, other}))
    if structural:
        return structural
    return Tie(
        "on this motion the difference of their torques is below the noise, or other parameters"
        " compensate it",
        f"for the one: {confirm_named}; for the other: {confirm_other}",
    )

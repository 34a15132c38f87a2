"""Units of angle and velocity: from names, from what integrates to what, from the encoder's steps,
from ranges."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipelines.contracts.checks import LARGEST_ANGLE_RAD
from pipelines.importing.guess.register import are_whole
from pipelines.importing.quantities.consistency import Agreement, integral_agreement
from pipelines.settings.units import UNITS

NEAR = 0.12
"""By so much a slope may be off that of two units: drives filter their velocities."""
MANY = 100.0
"""So many counts are no degrees."""
CLEAR = 0.7
"""Share of the variance that has to be in common for a slope to count."""
LEAST_GEAR, MOST_GEAR = 1.5, 1000.0
"""Ratios that a gear has between a motor and a joint."""
WHOLE = 0.01
"""So near to a whole number, as its share, a ratio is taken for it: drives filter their
velocities."""
VELOCITY_OF = {
    "rad": "rad/s",
    "mrad": "mrad/s",
    "deg": "deg/s",
    "rev": "rev/s",
    "m": "m/s",
    "cm": "cm/s",
    "mm": "mm/s",
    "um": "mm/s",
    "in": "in/s",
    "counts": "counts/s",
}
ANGLES, VELOCITIES = (
    ("rad", "deg", "rev", "m", "mm"),
    ("rad/s", "deg/s", "rpm", "rev/s", "m/s", "mm/s"),
)
"""Units that a log may be in without saying so."""
TURNS = {"rad": 2.0 * np.pi, "mrad": 2000.0 * np.pi, "deg": 360.0, "rev": 1.0}
"""A full turn in each unit."""


@dataclass(frozen=True)
class Units:
    """Units of an angle and of its velocity, each with why and whether it is sure."""

    angle: str
    why: str
    sure: bool
    velocity: str = ""
    velocity_why: str = ""
    velocity_sure: bool = True
    velocity_sign: int = 1
    gear: float = 1.0
    """Turns of what the velocity is of for one of what the angle is of."""


def guess_units(
    time_s: NDArray,
    angle: NDArray,
    named: str | None,
    velocity: NDArray | None,
    velocity_named: str | None,
) -> Units:
    """Return the units of an angle and its velocity, (n,) each as logged; names say more than
    numbers."""
    unit, why, sure = _angle_unit(angle, named)
    if velocity is None:
        return Units(unit, why, sure)
    agreement = integral_agreement(time_s, angle, velocity)
    if agreement is None or agreement.explained < CLEAR:
        share = 0.0 if agreement is None else agreement.explained
        doubt = (
            f"does not integrate to the angle ({share:.0%} of its variance): is it of this joint?"
        )
        return Units(unit, why, sure, velocity_named or VELOCITY_OF[unit], doubt, False)
    if unit == "counts":
        return Units(unit, why, sure, *_velocity_of_counts(velocity_named, agreement.slope))
    return _from_slope(agreement, unit, why, sure, velocity_named)


def _velocity_of_counts(named: str | None, slope: float) -> tuple[str, str, bool, int]:
    sign = int(np.sign(slope))
    if named:
        return named, "its name says so", True, sign
    if abs(abs(slope) - 1.0) < NEAR:
        return "counts/s", f"integrates to {slope:.4g} of the angle", True, sign
    why = "the angle is in counts; in what the velocity is, their slope alone does not say"
    return "counts/s", why, False, sign


def _from_slope(
    agreement: Agreement, unit: str, why: str, sure: bool, velocity_named: str | None
) -> Units:
    """Return the pair of units that explains how much velocity integrates to a unit of angle."""
    slope, sign = abs(agreement.slope), int(np.sign(agreement.slope))
    said = (
        f"integrates to {agreement.slope:.4g} of the angle ({agreement.explained:.0%} of its"
        " variance)"
    )
    fitting = [
        (one, other)
        for one in dict.fromkeys((*ANGLES, unit))
        for other in ([velocity_named] if velocity_named else VELOCITIES)
        if (UNITS[one].dimension == "angle") == (UNITS[other].dimension == "angular velocity")
        and abs(_turns(slope, one, other) - 1.0) < NEAR
    ]
    same = [pair for pair in fitting if pair[0] == unit]
    if same:
        of_it = sign * _turns(slope, *same[0])
        in_units = (
            f"integrates to {of_it:.4g} of the angle ({agreement.explained:.0%} of its variance)"
        )
        return Units(unit, why, sure, same[0][1], in_units, True, sign)
    if fitting and not sure:
        other, velocity = fitting[0]
        return Units(other, f"fits the velocity, which {said}", False, velocity, said, False, sign)
    if sure and velocity_named and (ratio := _gear(slope, unit, velocity_named)):
        geared = f"{said}, as of a motor that turns {ratio:g} times for one turn of the joint"
        if misnamed := _misnamed(slope, unit, velocity_named):
            geared += f"; or it is in {misnamed}, whatever its name says"
        return Units(unit, why, sure, velocity_named, geared, False, sign, ratio)
    return Units(
        unit,
        why,
        sure,
        velocity_named or VELOCITY_OF[unit],
        f"{said}, which no units explain",
        False,
        sign,
    )


def _turns(slope: float, unit: str, velocity: str) -> float:
    """Return how far what a velocity is of goes while what an angle is of goes one, in those
    units."""
    return slope * UNITS[velocity].factor / UNITS[unit].factor


def _gear(slope: float, unit: str, velocity: str) -> float | None:
    """Return the gear that a slope tells where both units are known, in few digits; None where it
    would be none."""
    if UNITS[unit].dimension != "angle" or UNITS[velocity].dimension != "angular velocity":
        return None
    ratio = _turns(slope, unit, velocity)
    near = round(ratio) if abs(ratio - round(ratio)) < WHOLE * ratio else float(f"{ratio:.3g}")
    return float(near) if LEAST_GEAR < ratio < MOST_GEAR else None


def _misnamed(slope: float, unit: str, velocity: str) -> str | None:
    """Return the unit that a speed would be in were it no motor's; None where none makes such a
    slope."""
    fitting = (
        other
        for other in VELOCITIES
        if other != velocity
        and UNITS[other].dimension == "angular velocity"
        and abs(_turns(slope, unit, other) - 1.0) < NEAR
    )
    return next(fitting, None)


def counts_in_a_turn(
    time_s: NDArray, angle: NDArray, velocity: NDArray, velocity_unit: str
) -> float | None:
    """Return the counts in a turn of what the velocity is of, an angle (n,) being in counts; None
    where none says."""
    if UNITS[velocity_unit].dimension != "angular velocity":
        return None
    agreement = integral_agreement(time_s, angle, velocity)
    if agreement is None or agreement.explained < CLEAR:
        return None
    return 2.0 * np.pi / abs(agreement.slope * UNITS[velocity_unit].factor)


def _angle_unit(angle: NDArray, named: str | None) -> tuple[str, str, bool]:
    if named is not None:
        return named, "its name says so", True
    known = angle[np.isfinite(angle)]
    reach = float(np.max(np.abs(known)))
    if are_whole(known):
        return "counts", "whole numbers only", reach > MANY
    by_step = _by_encoder_step(known)
    if by_step is not None:
        return by_step
    if reach > LARGEST_ANGLE_RAD:
        return (
            "deg",
            f"reaches {reach:.4g}, which in rad would be {reach / (2 * np.pi):.1f} turns",
            False,
        )
    in_degrees = f"in degrees that would be {np.radians(reach):.2g} rad"
    return "rad", f"reaches {reach:.4g}; {in_degrees}. No name says its unit", False


def _by_encoder_step(known: NDArray) -> tuple[str, str, bool] | None:
    """Return the unit in which an encoder's steps divide a turn into a power of two; None where
    none does."""
    steps = np.abs(np.diff(np.unique(known)))
    steps = steps[steps > 1e-9 * np.ptp(known)] if len(steps) else steps
    if len(steps) < 5:
        return None
    step = float(np.min(steps))
    if np.max(np.abs(steps / step - np.round(steps / step))) > 0.02:
        return None
    for unit, turn in TURNS.items():
        bits = np.log2(turn / step)
        if 9.5 < bits < 24.5 and abs(bits - round(bits)) < 1e-3:
            return unit, f"its steps of {step:.4g} make 2^{round(bits)} of a turn in {unit}", True
    return None

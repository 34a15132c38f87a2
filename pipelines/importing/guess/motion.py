"""Units of angle and velocity: from names, integrals, the encoder's steps, and ranges."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipelines.contracts.checks import LARGEST_ANGLE_RAD
from pipelines.importing.quantities.consistency import Agreement, integral_agreement
from pipelines.importing.quantities.numbers import are_whole
from pipelines.settings.units import UNITS

FROM_NAME = "from its name"
"""Reason for a unit that is in the name of its column."""
NEAR = 0.12
"""Largest relative error of a slope, as drives filter their velocities."""
EXACT = 0.02
"""Largest relative error of a slope that shows a unit for sure."""
CLEAR = 0.7
"""Least share of the variance that angle and velocity share if they are of one joint."""
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
"""Units that are tried where no name has one."""
TURNS = {"rad": 2.0 * np.pi, "mrad": 2000.0 * np.pi, "deg": 360.0, "rev": 1.0}
"""A full turn in each unit."""


@dataclass(frozen=True)
class Units:
    """Units of an angle and its velocity, each with its reason and whether it is sure."""

    angle: str
    why: str
    sure: bool
    velocity: str = ""
    velocity_why: str = ""
    velocity_sure: bool = True
    velocity_sign: int = 1
    gear: float = 1.0
    """Turns of the velocity's shaft for one turn of the angle's."""
    counts_in_turn: float | None = None
    """Counts of the angle in a turn of the velocity's shaft, if its unit shows them."""


def guess_units(
    time_s: NDArray,
    angle: NDArray,
    named: str | None,
    velocity: NDArray | None,
    velocity_named: str | None,
    doubt: str = "",
) -> Units:
    """Return the units of an angle and its velocity; names take precedence over numbers.

    Parameters
    ----------
    time_s : (n,) array
        Times, s.
    angle : (n,) array
        Angle as logged.
    named : str or None
        Unit in the name of its column.
    velocity : (n,) array or None
        Velocity as logged.
    velocity_named : str or None
        Unit in the name of its column.
    doubt : str, optional
        Another meaning that the unit in the angle's name may have.
    """
    unit, why, sure = _angle_unit(angle, named)
    if doubt:
        why, sure = f"{why}; {doubt}", False
    if velocity is None:
        return Units(unit, why, sure)
    agreement = integral_agreement(time_s, angle, velocity)
    if agreement is None or agreement.explained < CLEAR:
        share = 0.0 if agreement is None else agreement.explained
        doubt = f"does not integrate to the angle ({share:.0%} of its variance)"
        return Units(unit, why, sure, velocity_named or VELOCITY_OF[unit], doubt, False)
    if doubt and velocity_named and UNITS[velocity_named].dimension == "angular velocity":
        # 400 gons are a turn. A velocity in gons, too, would integrate to the whole angle.
        gon = abs(_turns(agreement.slope, unit, velocity_named)) / 0.9
        if abs(gon - 1.0) < EXACT:
            why += "; the velocity shows that it is: set scale = 0.9"
    if unit == "counts":
        units = Units(unit, why, sure, *_velocity_of_counts(velocity_named, agreement.slope, sure))
        of_velocity = UNITS[units.velocity]
        if of_velocity.dimension != "angular velocity":
            return units
        counts = 2.0 * np.pi / abs(agreement.slope * of_velocity.factor)
        return replace(units, counts_in_turn=counts)
    return _from_slope(agreement, unit, why, sure, velocity_named)


def _velocity_of_counts(named: str | None, slope: float, sure: bool) -> tuple[str, str, bool, int]:
    sign = int(np.sign(slope))
    if named:
        return named, FROM_NAME, True, sign
    if abs(abs(slope) - 1.0) < NEAR:
        return "counts/s", f"integrates to {slope:.4g} of the angle", sure, sign
    why = "the angle is in counts, so their slope does not show the velocity's unit"
    return "counts/s", why, False, sign


def _from_slope(
    agreement: Agreement, unit: str, why: str, sure: bool, velocity_named: str | None
) -> Units:
    """Return the pair of units that explains the integral of velocity per unit of angle."""
    slope, sign = abs(agreement.slope), int(np.sign(agreement.slope))
    explained = f"of the angle ({agreement.explained:.0%} of its variance)"
    reason = f"integrates to {agreement.slope:.4g} {explained}"
    fitting = [
        (one, other)
        for one in dict.fromkeys((*ANGLES, unit))
        for other in ([velocity_named] if velocity_named else VELOCITIES)
        if (UNITS[one].dimension == "angle") == (UNITS[other].dimension == "angular velocity")
        and abs(_turns(slope, one, other) - 1.0) < NEAR
    ]
    # A pair with the angle's own unit comes first: it changes the least.
    same = [pair for pair in fitting if pair[0] == unit]
    if same:
        turns = _turns(slope, *same[0])
        in_units = f"integrates to {sign * turns:.4g} {explained}"
        # A log keeps the factor between its units; a drive's filter changes it a little. Units of
        # which neither is known agree as well in degrees as in radians.
        certain = bool(velocity_named) or (sure and abs(turns - 1.0) < EXACT)
        return Units(unit, why, sure, same[0][1], in_units, certain, sign)
    if fitting and not sure:
        other, velocity = fitting[0]
        why = f"fits the velocity, which {reason}"
        return Units(other, why, False, velocity, reason, False, sign)
    # Both units are known, so the remaining factor is of a gear: the velocity is the motor's.
    ratio = _gear(slope, unit, velocity_named) if sure and velocity_named else None
    if ratio and velocity_named:
        reason += f", as of a motor that turns {ratio:g} times for one turn of the joint"
        return Units(unit, why, sure, velocity_named, reason, False, sign, ratio)
    velocity = velocity_named or VELOCITY_OF[unit]
    return Units(unit, why, sure, velocity, f"{reason}, which no units explain", False, sign)


def factors(slope: float, angle: str | None, velocity: str | None) -> list[float]:
    """Return a velocity's integral per angle in each pair of units that they may have.

    Parameters
    ----------
    slope : float
        Integral of the velocity per unit of angle, as logged.
    angle, velocity : str or None
        Their units; None where any that is usual may be.
    """
    return [
        _turns(slope, one, other)
        for one in ([angle] if angle else ANGLES)
        for other in ([velocity] if velocity else VELOCITIES)
        if (UNITS[one].dimension, UNITS[other].dimension)
        in (("angle", "angular velocity"), ("length", "velocity"))
    ]


def _turns(slope: float, unit: str, velocity: str) -> float:
    """Return the turns of the velocity's shaft for one of the angle's, in those units."""
    return slope * UNITS[velocity].factor / UNITS[unit].factor


def _gear(slope: float, unit: str, velocity: str) -> float | None:
    """Return the gear ratio of a slope where both units are known; None if it is unusual."""
    # Usual ratios of a gear between motor and joint.
    least_gear, most_gear = 1.5, 1000.0
    # Relative distance within which a gear ratio is rounded to a whole number.
    whole = 0.01
    if UNITS[unit].dimension != "angle" or UNITS[velocity].dimension != "angular velocity":
        return None
    ratio = _turns(slope, unit, velocity)
    near = round(ratio) if abs(ratio - round(ratio)) < whole * ratio else float(f"{ratio:.3g}")
    return float(near) if least_gear < ratio < most_gear else None


def _angle_unit(angle: NDArray, named: str | None) -> tuple[str, str, bool]:
    if named is not None:
        return named, FROM_NAME, True
    known = angle[np.isfinite(angle)]
    reach = float(np.max(np.abs(known)))
    if are_whole(known):
        return "counts", "whole numbers: of an encoder, or parts of a degree or radian", False
    by_step = _by_encoder_step(known)
    if by_step is not None:
        return by_step
    if reach > LARGEST_ANGLE_RAD:
        turns = reach / (2 * np.pi)
        return "deg", f"reaches {reach:.4g}, in rad {turns:.1f} turns", False
    in_degrees = f"in degrees only {np.radians(reach):.2g} rad"
    return "rad", f"reaches {reach:.4g}, {in_degrees}; no name has its unit", False


def _by_encoder_step(known: NDArray) -> tuple[str, str, bool] | None:
    """Return the unit in which an encoder's steps divide a turn into a power of two, if any."""
    steps = np.abs(np.diff(np.unique(known)))
    # Differences by rounding in float64 are no steps of the encoder.
    steps = steps[steps > 1e-9 * np.ptp(known)] if len(steps) else steps
    if len(steps) < 5:
        return None
    step = float(np.min(steps))
    if np.max(np.abs(steps / step - np.round(steps / step))) > 0.02:
        return None
    for unit, turn in TURNS.items():
        bits = np.log2(turn / step)
        # Encoders have 10 to 24 bits. Coarser steps divide a turn into a power of two by chance.
        if 9.5 < bits < 24.5 and abs(bits - round(bits)) < 1e-3:
            # Fixed-point numbers of any unit have steps of 2^-k, as parts of a turn have.
            why = f"its steps of {step:.4g} make 2^{round(bits)} of a turn in {unit}"
            return unit, why, unit != "rev"
    return None

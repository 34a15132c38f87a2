"""Find wrong units: channels a factor away from set-point, drive, other joint or other runs.

A factor near one is a gain, and physics. Only factors that no calibration error makes are sought
here.
"""

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from pipelines.contracts.joints import the
from pipelines.diagnosis.data_faults.fault import Fault, column
from pipelines.diagnosis.data_faults.nonnegative_leg import Averages, fit
from pipelines.mechanics.motion import Motion
from pipelines.mechanics.origin import settings_of

WRONG = 3.0
"""Least factor that is no gain, where it is well measured."""
WRONG_BETWEEN_JOINTS = 5.0
"""The same where missing physics of one joint can look like a factor of 2 to 3."""
SHANK_KG_M = {"exo_alone": 0.5, "with_human": 1.6}
"""A shank's mass times the distance of its centre from the knee: 1-4 kg of machine at 0.2-0.3 m,
and 6 % of 50-100 kg of person at 0.25 m (Winter, Biomechanics and Motor Control of Human Movement,
table 4.1)."""
IMPOSSIBLE = 30.0
"""Multiple, or part, of that mass moment beyond which there is no leg."""
EXPLAINED = 0.7
"""Share of the torque's power that rigid body and friction must explain before a joint's torque is
compared."""
NOTHING = 1e-4
"""Least scale that is compared. No unit is as far from N·m: the channels contradict each other in
another way."""
LOOP_EXPLAINS = 0.8
"""Share of the torque's power that a position loop must explain before its gain is compared."""
LARGEST_ANGLE_RAD = np.pi
"""Largest angle of a leg's joint from its zero; a pendulum may turn over."""
# How many of each unit are one N·m.
TORQUE_UNITS = {
    "N·mm": 1e3,
    "N·cm": 1e2,
    "kgf·cm": 10.197,
    "lbf·in": 8.851,
    "ozf·in": 141.6,
    "kgf·m": 0.10197,
    "kN·m": 1e-3,
}
SAME_UNIT = 1.3
"""Largest factor between a measured ratio and a unit's."""
FOLLOWS = 0.7
"""Correlation of an angle with its set-point below which it does not follow it, in any unit."""
SMALLER_UNITS, NEAR = (1 / (2 * np.pi), np.pi / 180, 1 / 360), 1.25
"""Turns per radian, radians per degree, turns per degree; and the factor within which a ratio is
near one of them."""


def angle_unit_faults(motion: Motion) -> Iterator[Fault]:
    """Yield angles in degrees or another unit: far beyond their set-point or a joint's range."""
    for j, name in enumerate(motion.joints):
        q = motion.q[motion.valid, j]
        factor = _times_set_point(motion, j)
        channel = column(motion, j, "angle")
        if factor and _is_a_unit(factor):
            # There are 57.3 degrees in a radian; a drive that lags changes the ratio a little.
            unit = "degrees" if 40 < factor < 80 else "another unit"
            yield Fault(
                motion.file,
                channel,
                f"{channel} is in {unit}: it moves {factor:.3g} times as far as its set-point, all"
                f" along; set the channel's scale in {settings_of(motion)}",
            )
        elif len(q) and motion.machine.is_exoskeleton and np.abs(q).max() > LARGEST_ANGLE_RAD:
            yield Fault(
                motion.file,
                channel,
                f"{channel} is not in radians, or its zero is lost: {the(name)} would reach"
                f" {np.abs(q).max():.3g} rad; if these are degrees, multiply by pi/180",
            )


def _is_a_unit(factor: float) -> bool:
    """Return whether an angle is so many times its set-point that only a unit explains it.

    A weak or soft drive moves less than its set-point, but hardly by the factor of a turn or a
    degree. None moves several times as far.
    """
    return factor > WRONG or any(1 / NEAR < factor / smaller < NEAR for smaller in SMALLER_UNITS)


def _times_set_point(motion: Motion, joint: int) -> float | None:
    """Return how many times its set-point an angle is; None where it does not follow it.

    A joint at rest does not follow its set-point, for example.
    """
    if motion.reference is None:
        return None
    reference, q = motion.reference[motion.valid, joint], motion.q[motion.valid, joint]
    known = np.isfinite(reference)
    asked, went = reference[known], q[known]
    if known.sum() < 2 or np.ptp(asked) == 0.0 or np.ptp(went) == 0.0:
        return None
    times = float(np.ptp(went) / np.ptp(asked))
    # A unit scales the mean as it scales the travel; a lost zero does not.
    follows = np.corrcoef(went, asked)[0, 1] > FOLLOWS and abs(
        went.mean() - times * asked.mean()
    ) < np.ptp(went)
    return times if follows else None


def torque_unit_faults(runs: Sequence[Averages]) -> Iterator[Fault]:
    """Yield torques in another unit than N·m, and runs at another scale than similar runs."""
    without_witness = []
    for run in runs:
        wrong = _against_the_drives(run)
        if wrong is None:
            # A position loop is the better witness: it does not depend on what the joints carry.
            wrong = _against_the_other_joint(run)
            without_witness += [] if wrong else [run]
        for j, (factor, witness) in wrong.items():
            yield _torque_fault(run, j, factor, witness)
    yield from _between_runs(without_witness)


def _against_the_drives(run: Averages) -> dict[int, tuple[float, str]] | None:
    """Return the joints whose torque contradicts their position loops; None if one is unknown."""
    ratios = [_torque_over_position_loop(run.motion, j) for j in range(2)]
    wrong = {
        j: (ratio, f"{the(name)}'s position loop")
        for j, (name, ratio) in enumerate(zip(run.motion.joints, ratios, strict=True))
        if ratio and not 1 / WRONG < ratio < WRONG
    }
    return None if None in ratios and not wrong else wrong


def _torque_over_position_loop(motion: Motion, joint: int) -> float | None:
    """Return recorded torque over that of the position loop in the metadata.

    The torque is fitted by the angle's error and both speeds; the multiple of the error is the
    loop's stiffness. The result is None where there is no such loop, or it explains too little.
    """
    controller = motion.metadata.get("controller", {}).get(motion.joints[joint], {})
    stiffness = controller.get("kp_nm_rad")
    if not stiffness or controller.get("type") != "pd" or motion.reference is None:
        return None
    reference, angle = motion.reference[:, joint], motion.q[:, joint]
    speed = np.gradient(reference) * motion.sample_rate_hz
    good = motion.valid & np.isfinite(speed)
    if not good.any():
        return None
    # The loop may damp the joint's speed or that of the error, so both speeds are columns.
    columns = np.column_stack([reference - angle, speed, motion.dq[:, joint]])[good]
    torque = motion.torque[good, joint]
    multiples = np.linalg.lstsq(columns.T @ columns, columns.T @ torque)[0]
    misfit = np.sum((torque - columns @ multiples) ** 2)
    holds = misfit < (1.0 - LOOP_EXPLAINS) * np.sum(torque**2)
    return float(abs(multiples[0])) / stiffness if holds else None


def _against_the_other_joint(run: Averages) -> dict[int, tuple[float, str]]:
    """Return the joints whose torque is in another unit, by the shank that both drives carry."""
    moment, scale = shank(run)
    of_a_leg = run.motion.machine.is_exoskeleton
    # The weight of another machine's second link is unknown: its first joint's torque is compared.
    typical = SHANK_KG_M[run.motion.run] if of_a_leg else moment
    if min(moment, scale) < NOTHING or any(
        fit(run.joint_columns(j), run.torque[:, j])[0] > 1.0 - EXPLAINED for j in range(2)
    ):
        return {}
    by_knee, by_hip = moment / typical, scale * moment / typical
    if 1 / WRONG_BETWEEN_JOINTS < scale < WRONG_BETWEEN_JOINTS:
        # Both joints agree, so only an impossible leg shows that both are in another unit.
        if 1 / IMPOSSIBLE < by_knee < IMPOSSIBLE:
            return {}
        return {j: (by_knee, "the weight of a leg") for j in range(2)}
    first, second = run.motion.joints
    link = "shank" if of_a_leg else "link"
    # The joint that makes the shank less plausible is the one in another unit.
    if abs(np.log(by_knee)) > abs(np.log(by_hip)):
        return {1: (1 / scale, f"{the(first)}, which carries the same {link}")}
    return {0: (scale, f"{the(second)}, which carries the same {link}")}


def shank(run: Averages) -> tuple[float, float]:
    """Return the shank's mass moment from the knee's torque, and its multiple at the hip.

    Drag at the hip can leave the multiple undetermined, but a wrong unit makes the shank too heavy
    for the hip.

    Parameters
    ----------
    run : Averages
        Blocks of one run.

    Returns
    -------
    tuple of float
        Moment, kg·m, and how many times this shank the hip's torque carries: 1 where it explains
        it.
    """
    at_knee = fit(run.joint_columns(1), run.torque[:, 1])[1]
    at_hip, torque = run.joint_columns(0), run.torque[:, 0]
    # X2 and X3 belong to the shank alone, so the knee's values predict its torque at the hip.
    same_shank, others = at_hip[:, 1:3] @ at_knee[:2], at_hip[:, [0, 3, 4, 5, 6, 7]]
    times = float(fit(np.column_stack([same_shank, others]), torque)[1][0])
    # If the hip's own columns explain what this very shank leaves, its multiple counts as one.
    if times < 1.0:
        rest = torque - same_shank
        residual = fit(others, rest)[0] * float(rest @ rest)
        times = 1.0 if residual < (1.0 - EXPLAINED) * float(torque @ torque) else times
    return float(at_knee[1]), times


def _between_runs(runs: Sequence[Averages]) -> Iterator[Fault]:
    """Compare every two runs of a kind: one's parameters predict the torque of the other."""
    for first, second in combinations(runs, 2):
        if first.motion.run != second.motion.run:
            continue
        for j in range(2):
            misfit, multiples = fit(first.joint_columns(j), first.torque[:, j])
            factor = _times_predicted(second, multiples, j)
            if misfit > 1.0 - EXPLAINED or 1 / WRONG < factor < WRONG:
                continue
            odd, like = (second, first) if _less_plausible(second, first) else (first, second)
            times = factor if odd is second else 1 / max(factor, 1e-6)
            whose = "leg" if odd.motion.machine.is_exoskeleton else "machine"
            yield _torque_fault(
                odd, j, times, f"{like.motion.file}, another run of the same {whose}"
            )


def _times_predicted(run: Averages, multiples: NDArray, joint: int) -> float:
    """Return the run's torque as a multiple of the prediction by another run's parameters."""
    predicted = run.joint_columns(joint) @ multiples
    # A reversed torque has no factor; a tiny one keeps its reciprocal finite.
    return max(float(predicted @ run.torque[:, joint] / max(predicted @ predicted, 1e-12)), 1e-6)


def _less_plausible(run: Averages, than: Averages) -> bool:
    if not run.motion.machine.is_exoskeleton:
        return True  # one of the two is wrong; either may be

    def distance(one: Averages) -> float:
        return abs(float(np.log(max(shank(one)[0], 1e-6) / SHANK_KG_M[one.motion.run])))

    return distance(run) > distance(than)


def _torque_fault(run: Averages, joint: int, factor: float, witness: str) -> Fault:
    channel = column(run.motion, joint, "torque")
    like = [
        unit for unit, size in TORQUE_UNITS.items() if 1 / SAME_UNIT < factor / size < SAME_UNIT
    ]
    guess = f" ({' or '.join(like)}?)" if like else ""
    return Fault(
        run.motion.file,
        channel,
        f"{channel} is in another unit than N·m{guess}: a factor of {factor:.3g} against {witness},"
        f" all along; set the channel's scale in {settings_of(run.motion)}",
    )

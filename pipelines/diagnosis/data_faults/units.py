"""Find wrong units: channels a factor away from set-point, drive, other joint or other runs.

A factor near one is a gain, and physics. Only factors that no calibration error makes are sought
here.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from pipelines.contracts.fault_kind import FaultKind
from pipelines.contracts.joints import the
from pipelines.diagnosis.data_faults.fault import Fault, column
from pipelines.diagnosis.data_faults.mends import mended
from pipelines.diagnosis.data_faults.proof import (
    AGREES,
    Prediction,
    Proof,
    Ruling,
    by_motion,
    predictions,
)
from pipelines.diagnosis.data_faults.rigid_fit import Averages, Columns, fit, pooled, predicted
from pipelines.mechanics.motion import Motion
from pipelines.mechanics.remedies import how_to_correct

WRONG = 3.0
"""Least factor that is no gain, where it is well measured."""
SHANK_KG_M = {"exo_alone": 0.5, "with_human": 1.6}
"""A shank's mass times the distance of its centre from the knee: 1-4 kg of machine at 0.2-0.3 m,
and 6 % of 50-100 kg of person at 0.25 m (Winter, Biomechanics and Motor Control of Human Movement,
table 4.1)."""
IMPOSSIBLE = 30.0
"""Multiple, or part, of that mass moment beyond which there is no leg."""
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
        times = _times_set_point(motion, j)
        channel = column(motion, j, "angle")
        if times and _is_a_unit(times):
            factor = times
            # There are 57.3 degrees in a radian; a drive that lags changes the ratio a little.
            unit = "degrees" if 40 < times < 80 else "another unit"
            what = f"in {unit}: it moves {times:.3g} times as far as its set-point, all along"
        elif (
            len(q)
            and motion.machine.joints[j].kind == "revolute"
            and not motion.machine.joints[j].turns
            and np.abs(q).max() > LARGEST_ANGLE_RAD
        ):
            factor, times = float(np.degrees(1.0)), None
            what = (
                f"not in radians, or its zero is lost: {the(name)} would reach"
                f" {np.abs(q).max():.3g} rad, as if in degrees"
            )
        else:
            continue
        fault = Fault(
            FaultKind.UNIT,
            motion.file,
            channel,
            f"{channel} is {what}; {how_to_correct(motion, 'unit')}",
            proof=_proof_of_angle(motion, j, factor),
        )
        # A set-point may be in another unit, too, and a machine that is no leg may turn over.
        may_turn = not times and not motion.machine.is_exoskeleton
        weaker = fault.proof is None or fault.proof.mended >= fault.proof.recorded
        if fault.ruling is not Ruling.REFUTED and not (may_turn and weaker):
            yield fault


def _proof_of_angle(motion: Motion, joint: int, factor: float) -> Proof | None:
    """Return what it changes to divide an angle by a factor."""
    if motion.measured_angle is None:
        return None
    scales = np.where(np.arange(len(motion.joints)) == joint, 1.0 / factor, 1.0)
    return by_motion(motion, mended(motion, angle=motion.measured_angle * scales))


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


@dataclass(frozen=True)
class Scale:
    """A joint's torque in a run, as a multiple of what a witness predicts."""

    run: Averages
    joint: int
    factor: float
    witness: str
    proof: Proof | None
    or_other: bool = False
    """Whether the other joint's torque may as well be wrong, by the inverse factor."""

    @property
    def fault(self) -> Fault:
        """The fault that it is."""
        channel = column(self.run.motion, self.joint, "torque")
        wrong = f"{channel} is in another unit than N·m{_like(self.factor)}"
        if self.or_other:
            other = column(self.run.motion, 1 - self.joint, "torque")
            wrong += f", or {other} is{_like(1.0 / self.factor)}"
        return Fault(
            FaultKind.UNIT,
            self.run.motion.file,
            channel,
            f"{wrong}: a factor of {self.factor:.3g} against {self.witness}, all along;"
            f" {how_to_correct(self.run.motion, 'unit')}",
            proof=self.proof,
        )


def _like(factor: float) -> str:
    """Return the units of torque that are so many times smaller than 1 N·m, as a question."""
    like = [
        unit for unit, size in TORQUE_UNITS.items() if 1 / SAME_UNIT < factor / size < SAME_UNIT
    ]
    return f" ({' or '.join(like)}?)" if like else ""


def torque_unit_faults(runs: Sequence[Averages]) -> Iterator[Fault]:
    """Yield torques of legs in another unit than N·m, and runs at another scale than others."""
    wrong: list[Scale] = []
    without_loop: list[Averages] = []
    for run in runs:
        # A position loop is the better witness: it does not depend on what the joints carry.
        by_loop = _against_the_drives(run)
        if by_loop is None:
            without_loop.append(run)
        else:
            wrong += by_loop
    without_witness = []
    for kind in {run.motion.run: None for run in without_loop}:
        of_kind = [run for run in without_loop if run.motion.run == kind]
        scales = _against_the_other_joint(pooled(of_kind))
        wrong += [replace(scale, run=run) for run in of_kind for scale in scales]
        if not scales:
            without_witness += of_kind
    yield from (scale.fault for scale in [*wrong, *_between_runs(without_witness)])


def _against_the_drives(run: Averages) -> list[Scale] | None:
    """Return the torques that contradict their position loops; None if one is unknown."""
    ratios = [_torque_over_position_loop(run.motion, j) for j in range(2)]
    wrong = []
    for j, (name, ratio) in enumerate(zip(run.motion.joints, ratios, strict=True)):
        if ratio and not 1 / WRONG < ratio < WRONG:
            # A knee in another unit has a shank that many times too heavy for the hip.
            proof = _at_the_hip(run, 1 / ratio if j else ratio)
            wrong.append(Scale(run, j, ratio, f"{the(name)}'s position loop", proof))
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


def _against_the_other_joint(run: Averages) -> list[Scale]:
    """Return the torques in another unit, by the shank that both drives carry.

    One motion may not part the shank from a spring, so all runs of a kind are taken together.
    """
    moment, scale = shank(run)
    if min(moment, scale) <= 0.0:
        return []
    of_a_leg = run.motion.machine.is_exoskeleton
    # The mass of another machine's second link is unknown: either joint may be in another unit.
    typical = SHANK_KG_M[run.motion.run] if of_a_leg else moment
    by_knee, by_hip = moment / typical, scale * moment / typical
    proof = _at_the_hip(run, scale)
    if 1 / WRONG < scale < WRONG or proof.ruling is not Ruling.VETO:
        # Both joints agree, so only an impossible leg shows that both are in another unit.
        agree = min(one.agreement for one in predictions(run)) > AGREES
        if 1 / IMPOSSIBLE < by_knee < IMPOSSIBLE or not agree:
            return []
        return [Scale(run, j, by_knee, "the weight of a leg", None) for j in range(2)]
    first, second = run.motion.joints
    link = "shank" if of_a_leg else "link"
    # The joint that makes the shank less plausible is the one in another unit.
    if abs(np.log(by_knee)) > abs(np.log(by_hip)):
        return [Scale(run, 1, 1 / scale, f"{the(first)}, which carries the same {link}", proof)]
    witness = f"{the(second)}, which carries the same {link}"
    return [Scale(run, 0, scale, witness, proof, or_other=not of_a_leg)]


def shank(run: Averages) -> tuple[float, float]:
    """Return the shank's mass moment from the knee's torque, and its multiple at the hip.

    Parameters
    ----------
    run : Averages
        Blocks of one run of a leg.

    Returns
    -------
    tuple of float
        Moment, kg·m, and how many times this shank the hip's torque carries.
    """
    at_knee, same_shank, others = _shank_at_the_hip(run)
    with_shank = Columns(np.column_stack([same_shank, others.positive]), others.free)
    return float(at_knee[1]), float(fit(with_shank, run.torque[:, 0])[0])


def _shank_at_the_hip(run: Averages) -> tuple[NDArray, NDArray, Columns]:
    """Return the knee's values, its shank's torque at the hip (m,) N·m, and the hip's columns."""
    at_knee, at_hip = fit(run.columns(1), run.torque[:, 1]), run.columns(0)
    # X2 and X3 belong to the shank alone, so the knee's values predict its torque at the hip.
    own = Columns(np.delete(at_hip.positive, [1, 2], axis=1), at_hip.free)
    return at_knee, at_hip.positive[:, 1:3] @ at_knee[:2], own


def _at_the_hip(run: Averages, times: float) -> Proof:
    """Return what it changes at the hip that it carries so many times the knee's shank."""
    _, same_shank, others = _shank_at_the_hip(run)
    torque = run.torque[:, 0]
    recorded, scaled = (
        Prediction(torque, part + predicted(others, torque - part))
        for part in (same_shank, times * same_shank)
    )
    agreement = min(scaled.agreement, predictions(run)[1].agreement)
    return Proof(recorded.unexplained, scaled.unexplained, agreement)


def _between_runs(runs: Sequence[Averages]) -> list[Scale]:
    """Compare every two runs of a kind: one's parameters predict the torque of the other."""
    apart = [
        (first, second, j, factor, proof)
        for first, second in combinations(runs, 2)
        if first.motion.run == second.motion.run
        for j in range(2)
        for factor, proof in _times_predicted(first, second, j)
    ]
    contradictions = Counter(
        (run.motion.file, j) for first, second, j, *_ in apart for run in (first, second)
    )
    scales: dict[tuple[str, int], Scale] = {}
    for first, second, j, factor, proof in apart:
        ones, others = (contradictions[run.motion.file, j] for run in (first, second))
        # The run that contradicts more runs is the odd one.
        is_second = _less_plausible(second, first) if ones == others else others > ones
        odd, like, times = (second, first, factor) if is_second else (first, second, 1 / factor)
        whose = "leg" if odd.motion.machine.is_exoskeleton else "machine"
        witness = f"{like.motion.file}, another run of the same {whose}"
        scales.setdefault((odd.motion.file, j), Scale(odd, j, times, witness, proof))
    return list(scales.values())


def _times_predicted(
    first: Averages, second: Averages, joint: int
) -> Iterator[tuple[float, Proof]]:
    """Yield the factor between a run's torque and its prediction by another run, with its proof.

    A heavier load has other inertia and weight, and the same friction. So a factor counts only
    where another body with the first run's friction explains far less.
    """
    columns, torque = second.columns(joint), second.torque[:, joint]
    values = fit(first.columns(joint), first.torque[:, joint])
    positive = values[: columns.positive.shape[1]]
    whole, law = columns.split(values)
    factor = float(fit(Columns(whole[:, np.newaxis], columns.free), torque)[0])
    if factor == 0.0 or 1 / WRONG < factor < WRONG:
        return
    friction = columns.positive[:, -2:] @ positive[-2:]
    body = Columns(columns.positive[:, :-2], columns.free)
    other_load = Prediction(torque, friction + predicted(body, torque - friction))
    scaled = torque / factor
    same = Prediction(scaled, whole + predicted(law, scaled - whole))
    proof = Proof(other_load.unexplained, same.unexplained, same.agreement)
    if proof.ruling is Ruling.VETO:
        yield factor, proof


def _less_plausible(run: Averages, than: Averages) -> bool:
    if not run.motion.machine.is_exoskeleton:
        return True  # one of the two is wrong; either may be

    def distance(one: Averages) -> float:
        return abs(float(np.log(max(shank(one)[0], 1e-6) / SHANK_KG_M[one.motion.run])))

    return distance(run) > distance(than)

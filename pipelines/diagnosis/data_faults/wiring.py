"""Find wrong wiring: channels of hip and knee exchanged, and reversed signs.

The angles are compared with their set-points, where these were recorded. Then all channels are
compared with the torque of a leg (``rigid_fit.py``): a wiring is wrong when another explains
both joints far better.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.contracts.fault_kind import FaultKind
from pipelines.contracts.joints import the
from pipelines.diagnosis.data_faults.fault import WHOLE_ROW, Fault, column
from pipelines.diagnosis.data_faults.mends import mended
from pipelines.diagnosis.data_faults.proof import MOST, Prediction, Proof, by_motion, compared
from pipelines.diagnosis.data_faults.rigid_fit import (
    AS_RECORDED,
    EXCHANGED,
    KNEE_REVERSED,
    Averages,
    Reading,
    cuff_columns,
    fit,
    joined,
    predicted,
)
from pipelines.mechanics.motion import CUFFS, Motion
from pipelines.mechanics.remedies import how_to_correct

FOLLOWS = 0.9
"""Correlation of an angle with its set-point from which it follows it."""
SIGN, SWAP = "reversed", "exchanged"

Channels = tuple[tuple[int, str], ...]
"""Numbers of joints, and a quantity of each."""


class Wiring(NamedTuple):
    """A way in which the channels of a leg may be wired."""

    reading: Reading
    """Of the angles."""
    columns: tuple[int, int]
    """Of hip's and knee's torque."""
    signs: tuple[float, float]
    """Of these torques."""
    wrong: Channels
    """Channels that are not as they should be."""
    how: str
    """``SIGN`` or ``SWAP``; empty where all are right."""


HIP, KNEE = 0, 1
"""Columns of the joints."""
STRAIGHT, CROSSED = (HIP, KNEE), (KNEE, HIP)
"""Columns of the torques of hip and knee."""
BOTH_TORQUES = ((HIP, "torque"), (KNEE, "torque"))
BOTH_ANGLES = ((HIP, "angle"), (KNEE, "angle"))
WIRINGS: tuple[Wiring, ...] = (
    Wiring(AS_RECORDED, STRAIGHT, (1.0, 1.0), (), ""),
    Wiring(AS_RECORDED, STRAIGHT, (-1.0, 1.0), ((HIP, "torque"),), SIGN),
    Wiring(AS_RECORDED, STRAIGHT, (1.0, -1.0), ((KNEE, "torque"),), SIGN),
    Wiring(AS_RECORDED, STRAIGHT, (-1.0, -1.0), BOTH_TORQUES, SIGN),
    Wiring(AS_RECORDED, CROSSED, (1.0, 1.0), BOTH_TORQUES, SWAP),
    Wiring(EXCHANGED, STRAIGHT, (1.0, 1.0), BOTH_ANGLES, SWAP),
    Wiring(EXCHANGED, CROSSED, (1.0, 1.0), BOTH_ANGLES + BOTH_TORQUES, SWAP),
    # The equations are odd. A reversed hip is a reversed knee with all torques reversed. A hip
    # reversed in both channels looks like such a knee, and both angles look like both torques.
    Wiring(KNEE_REVERSED, STRAIGHT, (1.0, 1.0), ((KNEE, "angle"),), SIGN),
    Wiring(KNEE_REVERSED, STRAIGHT, (-1.0, -1.0), ((HIP, "angle"),), SIGN),
    Wiring(KNEE_REVERSED, STRAIGHT, (1.0, -1.0), ((KNEE, "angle"), (KNEE, "torque")), SIGN),
)
MIRROR_IMAGES: dict[Channels, str] = {
    BOTH_TORQUES: "both angles",
    ((KNEE, "angle"), (KNEE, "torque")): "the hip's angle and torque",
}


def angle_faults(motion: Motion) -> Iterator[Fault]:
    """Yield angles that do not follow their own set-points: exchanged or reversed."""
    if motion.reference is None or motion.measured_angle is None:
        return
    if not np.isfinite(motion.reference[motion.valid]).all():
        return
    q, reference = motion.q[motion.valid], motion.reference[motion.valid]
    joints = q.shape[1]
    # A constant angle has no correlation.
    if (np.ptp(q, axis=0) == 0).any() or (np.ptp(reference, axis=0) == 0).any():
        return
    alike = np.corrcoef(q, reference, rowvar=False)[:joints, joints:]
    for j in range(joints):
        own, best = alike[j, j], int(np.argmax(alike[j]))
        if own < -FOLLOWS:
            why = f"it moves against its set-point (correlation {own:.2f})"
            reversed_angle = np.where(np.arange(joints) == j, -1.0, 1.0) * motion.measured_angle
            proof = by_motion(motion, mended(motion, angle=reversed_angle))
            yield _fault(motion, ((j, "angle"),), SIGN, why, proof)
        elif (
            best != j
            and alike[j, best] > FOLLOWS
            # Set-points of both joints may be alike, and then each angle follows both.
            and own < FOLLOWS / 2
            and alike[best, j] > FOLLOWS
            # A pair is reported once.
            and j < best
        ):
            one, other = f"{alike[j, best]:.2f}", f"{alike[best, j]:.2f}"
            why = f"each follows the other's set-point (correlations {one} and {other})"
            order = np.arange(joints)
            order[[j, best]] = best, j
            exchanged = mended(motion, angle=motion.measured_angle[:, order])
            proof = by_motion(motion, exchanged, channels=2)
            yield _fault(motion, ((j, "angle"), (best, "angle")), SWAP, why, proof)


def wiring_faults(runs: Sequence[Averages]) -> Iterator[Fault]:
    """Yield channels that fit a leg only when exchanged or reversed, in all runs of a kind or one.

    Parameters
    ----------
    runs : sequence of Averages
        Runs of one kind of one leg.
    """
    judged = [Wirings(run) for run in runs]
    wiring, proof = _best(lambda one: [pair for run in judged for pair in run.under(one)])
    if wiring is not None:
        yield from (_of_wiring(run.motion, wiring, proof) for run in runs)
        return
    if len(runs) < 2:
        return
    for k, run in enumerate(runs):
        by_others = Wirings(run, [*runs[:k], *runs[k + 1 :]])
        wiring, proof = _best(by_others.under)
        if wiring is not None:
            yield _of_wiring(run.motion, wiring, proof)


def _best(
    under: Callable[[Wiring], Sequence[Prediction]],
) -> tuple[Wiring | None, Proof]:
    """Return the wiring that removes most of the error, if any, with its proof."""
    as_recorded = under(WIRINGS[0])

    def misfit(wiring: Wiring) -> float:
        return sum(one.unexplained for one in under(wiring)) / MOST ** len(wiring.wrong)

    best = min(WIRINGS, key=misfit)
    # An angle takes part in the torque of both joints.
    torques = {joint for joint, quantity in best.wrong if quantity == "torque"}
    at = torques if all(quantity == "torque" for _, quantity in best.wrong) else {HIP, KNEE}
    chosen = [k for k in range(len(as_recorded)) if k % 2 in at or not best.wrong]
    mended = under(best)
    proof = compared([as_recorded[k] for k in chosen], [mended[k] for k in chosen], len(best.wrong))
    return (best if best.wrong and proof.removes_most else None), proof


class Wirings:
    """The torque of both joints of a run under each wiring, and its prediction.

    A body fitted to the other parts of the run predicts each part; where other runs are given, one
    fitted to these, as recorded.
    """

    def __init__(self, run: Averages, others: Sequence[Averages] = ()) -> None:
        self.run = run
        self.bodies = [
            fit(
                joined([one.columns(j) for one in others]),
                np.concatenate([one.torque[:, j] for one in others]),
            )
            for j in (HIP, KNEE)
            if others
        ]
        self.known: dict[tuple[Reading, int, int, float], Prediction] = {}

    def under(self, wiring: Wiring) -> list[Prediction]:
        """Return the predictions at hip and knee under a wiring."""
        return [
            self._one(wiring.reading, j, wiring.columns[j], wiring.signs[j]) for j in (HIP, KNEE)
        ]

    def _one(self, reading: Reading, joint: int, channel: int, sign: float) -> Prediction:
        key = reading, joint, channel, sign
        # Joints are fitted apart, so that 24 fits serve all wirings.
        if key not in self.known:
            torque, columns = sign * self.run.torque[:, channel], self.run.columns(joint, reading)
            if self.bodies:
                # Zeros differ from run to run.
                whole, law = columns.split(self.bodies[joint])
                self.known[key] = Prediction(torque, whole + predicted(law, torque - whole))
            else:
                self.known[key] = Prediction(torque, predicted(columns, torque))
        return self.known[key]


def _of_wiring(motion: Motion, wiring: Wiring, proof: Proof) -> Fault:
    mirror = MIRROR_IMAGES.get(wiring.wrong, "") if wiring.how == SIGN else ""
    if mirror:
        mirror = mirror.replace("the hip", the(motion.joints[HIP]))
        mirror = f"reversing {mirror} instead gives the same"
    return _fault(motion, wiring.wrong, wiring.how, mirror, proof)


def cuff_faults(run: Averages) -> Iterator[Fault]:
    """Yield force sensors that carry a limb only when exchanged or reversed."""
    # Without a wearer, the cuffs carry no limb whose weight could show their signs.
    if run.cuffs is None or run.motion.run != "with_human" or not np.isfinite(run.cuffs).all():
        return
    readings: dict[str, NDArray] = {
        "thigh and shank are exchanged": run.cuffs[:, ::-1],
        "the sign of all is reversed": -run.cuffs,
        "the sign of the thigh's is reversed": run.cuffs * [[-1.0], [1.0]],
        "the sign of the shank's is reversed": run.cuffs * [[1.0], [-1.0]],
    }
    as_recorded = _limb(run, run.cuffs)
    limbs = {what: _limb(run, cuffs) for what, cuffs in readings.items()}
    best = min(limbs, key=lambda what: limbs[what].unexplained)
    proof = compared([as_recorded], [limbs[best]], channels=2)
    if not proof.removes_most:
        return
    chosen = [
        cuff for cuff in CUFFS if "all" in best or "exchanged" in best or cuff.split("_")[0] in best
    ]
    yield Fault(
        FaultKind.CUFFS,
        run.motion.file,
        f"{chosen[0]}_force_y_n",
        f"cuff forces fit no limb, unless {best} (swapped or reversed sensors, {len(chosen)} of"
        " them); check the sensors' addresses and axes",
        proof=proof,
    )


def _limb(run: Averages, cuffs: NDArray) -> Prediction:
    """Return the torque of the cuffs on a limb, and the torque that a limb predicts."""
    columns, torque = cuff_columns(run, cuffs)
    return Prediction(torque, columns.torque(fit(columns, torque)))


def _fault(motion: Motion, channels: Channels, how: str, why: str, proof: Proof | None) -> Fault:
    columns = [column(motion, *channel) for channel in channels]
    names = " and ".join(columns)
    because = f": {why}" if why else ""
    return Fault(
        FaultKind.SIGN if how == SIGN else FaultKind.SWAP,
        motion.file,
        columns[0] if len(columns) == 1 else WHOLE_ROW,
        f"the sign of {names} is reversed, all along{because}; {how_to_correct(motion, 'sign')}"
        if how == SIGN
        else f"{names} are swapped, all along{because}; {how_to_correct(motion, 'column')}",
        proof=proof,
    )

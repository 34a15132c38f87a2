"""Find wrong wiring: channels of hip and knee exchanged, and reversed signs.

The angles are compared with their set-points, where these were recorded. Then all channels are
compared with the torque of a leg (``nonnegative_leg.py``): a wiring is wrong when another explains
both joints far better.
"""

from collections.abc import Iterator
from itertools import product

import numpy as np
from numpy.typing import NDArray

from pipelines.contracts.joints import the
from pipelines.diagnosis.data_faults.fault import WHOLE_ROW, Fault, column
from pipelines.diagnosis.data_faults.nonnegative_leg import (
    AS_RECORDED,
    EXCHANGED,
    KNEE_REVERSED,
    Averages,
    Reading,
    cuff_misfit,
    fit,
)
from pipelines.mechanics.motion import CUFFS, Motion
from pipelines.mechanics.origin import settings_of

FAR_BETTER = 0.5
"""Factor by which the unexplained power must fall for each channel that is reported as wrong: more
channels are less likely. Missing physics of a quarter of the torque changes it by a few tenths."""
A_LIMB = 0.05
"""Largest unexplained share of the cuffs' power at which they measure a limb, whatever explains
more."""
FOLLOWS = 0.9
"""Correlation of an angle with its set-point from which it follows it."""
SIGN, SWAP = "reversed", "exchanged"

Channels = tuple[tuple[int, str], ...]
"""Numbers of joints, and a quantity of each."""
Wiring = tuple[Reading, tuple[int, int], tuple[float, float], Channels, str]
"""Reading of the angles; columns of hip's and knee's torque; their signs; wrong channels, and
how."""
HIP, KNEE = 0, 1
"""Columns of the joints."""
STRAIGHT, CROSSED = (HIP, KNEE), (KNEE, HIP)
"""Columns of the torques of hip and knee."""
BOTH_TORQUES = ((HIP, "torque"), (KNEE, "torque"))
BOTH_ANGLES = ((HIP, "angle"), (KNEE, "angle"))
WIRINGS: tuple[Wiring, ...] = (
    (AS_RECORDED, STRAIGHT, (1.0, 1.0), (), ""),
    (AS_RECORDED, STRAIGHT, (-1.0, 1.0), ((HIP, "torque"),), SIGN),
    (AS_RECORDED, STRAIGHT, (1.0, -1.0), ((KNEE, "torque"),), SIGN),
    (AS_RECORDED, STRAIGHT, (-1.0, -1.0), BOTH_TORQUES, SIGN),
    (AS_RECORDED, CROSSED, (1.0, 1.0), BOTH_TORQUES, SWAP),
    (EXCHANGED, STRAIGHT, (1.0, 1.0), BOTH_ANGLES, SWAP),
    (EXCHANGED, CROSSED, (1.0, 1.0), BOTH_ANGLES + BOTH_TORQUES, SWAP),
    # The equations are odd. A reversed hip is a reversed knee with all torques reversed. A hip
    # reversed in both channels looks like such a knee, and both angles look like both torques.
    (KNEE_REVERSED, STRAIGHT, (1.0, 1.0), ((KNEE, "angle"),), SIGN),
    (KNEE_REVERSED, STRAIGHT, (-1.0, -1.0), ((HIP, "angle"),), SIGN),
    (KNEE_REVERSED, STRAIGHT, (1.0, -1.0), ((KNEE, "angle"), (KNEE, "torque")), SIGN),
)
MIRROR_IMAGES: dict[Channels, str] = {
    BOTH_TORQUES: "both angles",
    ((KNEE, "angle"), (KNEE, "torque")): "the hip's angle and torque",
}


def angle_faults(motion: Motion) -> Iterator[Fault]:
    """Yield angles that do not follow their own set-points: exchanged or reversed."""
    if motion.reference is None or not np.isfinite(motion.reference[motion.valid]).all():
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
            yield _fault(motion, ((j, "angle"),), SIGN, why)
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
            yield _fault(motion, ((j, "angle"), (best, "angle")), SWAP, why)


def wiring_faults(run: Averages) -> Iterator[Fault]:
    """Yield channels that fit a leg only when exchanged or reversed."""
    # Joints are fitted apart, so that 24 fits serve all combinations.
    misfits: dict[tuple[Reading, int, int, float], float] = {}
    for reading, joint in product((AS_RECORDED, KNEE_REVERSED, EXCHANGED), (HIP, KNEE)):
        columns = run.joint_columns(joint, reading)
        for channel, sign in product((HIP, KNEE), (1.0, -1.0)):
            misfits[reading, joint, channel, sign] = fit(columns, sign * run.torque[:, channel])[0]

    def misfit(wiring: Wiring) -> float:
        reading, channels, signs, *_ = wiring
        return sum(misfits[reading, j, channels[j], signs[j]] for j in (HIP, KNEE)) / 2

    as_recorded = WIRINGS[0]
    best = min(WIRINGS, key=lambda wiring: misfit(wiring) / FAR_BETTER ** len(wiring[3]))
    if best is as_recorded:
        return
    why = (
        f"rigid body and friction then leave {_percent(misfit(best))} of the torques' power"
        f" unexplained, {_percent(misfit(as_recorded))} as recorded"
    )
    mirror = MIRROR_IMAGES.get(best[3])
    if best[4] == SIGN and mirror:
        mirror = mirror.replace("the hip", the(run.motion.joints[HIP]))
        why += f" (reversing {mirror} instead gives the same)"
    yield _fault(run.motion, best[3], best[4], why)


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
    as_recorded = cuff_misfit(run, run.cuffs)
    misfits = {what: cuff_misfit(run, cuffs) for what, cuffs in readings.items()}
    best = min(misfits, key=misfits.__getitem__)
    if as_recorded > A_LIMB and misfits[best] < FAR_BETTER**2 * as_recorded:
        chosen = [
            cuff
            for cuff in CUFFS
            if "all" in best or "exchanged" in best or cuff.split("_")[0] in best
        ]
        yield Fault(
            run.motion.file,
            f"{chosen[0]}_force_y_n",
            f"cuff forces fit no limb, unless {best} (swapped or reversed sensors, {len(chosen)} of"
            f" them): then {_percent(misfits[best])} of their torque's power is unexplained, not"
            f" {_percent(as_recorded)}; check the sensors' addresses and axes",
        )


def _fault(motion: Motion, channels: Channels, how: str, why: str) -> Fault:
    columns = [column(motion, *channel) for channel in channels]
    names, settings = " and ".join(columns), settings_of(motion)
    return Fault(
        motion.file,
        columns[0] if len(columns) == 1 else WHOLE_ROW,
        f"the sign of {names} is reversed, all along: {why}; reverse it in {settings}, if every run"
        " has it, and in this recording"
        if how == SIGN
        else f"{names} are swapped, all along: {why}; exchange the joints in {settings}",
    )


def _percent(share: float) -> str:
    return f"{100 * share:.2g} %"

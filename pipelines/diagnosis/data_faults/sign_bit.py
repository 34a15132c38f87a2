"""Find registers that hold a magnitude and a sign bit, but were read as plain numbers.

Such a channel has two branches: one near zero, and one that begins where the sign bit stands. It
jumps from one to the other, and never passes between them. Turned round or shifted, the far branch
is the near one's other sign.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pipelines.contracts.fault_kind import FaultKind
from pipelines.diagnosis.data_faults.fault import Fault, column
from pipelines.diagnosis.data_faults.mends import mended
from pipelines.diagnosis.data_faults.proof import Proof, Ruling, by_motions
from pipelines.mechanics.motion import Motion
from pipelines.mechanics.remedies import how_to_correct


def sign_bit_faults(motion: Motion) -> Iterator[Fault]:
    """Yield channels with two branches that are one signed quantity."""
    for joint in range(len(motion.joints)):
        for quantity in ("torque", "angle"):
            channel = motion.torque if quantity == "torque" else motion.measured_angle
            if channel is None:
                continue
            # An angle seldom rests near its zero, where a magnitude would show its sign.
            branches = _far_branches(channel[:, joint], 5 if quantity == "torque" else 1)
            proofs = [_proof(motion, quantity, joint, far) for far in branches]
            proven = [
                (far, proof)
                for far, proof in zip(branches, proofs, strict=True)
                if proof is not None and proof.ruling is Ruling.VETO
            ]
            if not proven:
                continue
            far, proof = min(proven, key=lambda one: one[1].mended)
            name, begin = column(motion, joint, quantity), np.abs(channel[far, joint]).min()
            yield Fault(
                FaultKind.SIGN_BIT,
                motion.file,
                name,
                f"{name} has two branches, the second from {begin:.4g} on: a magnitude with a sign"
                f" bit, read as a plain number; {how_to_correct(motion, 'sign_bit')}",
                proof=proof,
            )


def _proof(motion: Motion, quantity: str, joint: int, far: NDArray) -> Proof | None:
    """Return what it changes to join both branches, of either sign.

    The channel as recorded is given either sign, too: a wrong sign alone makes no branches.
    """
    whole = motion.torque if quantity == "torque" else motion.measured_angle
    assert whole is not None
    one = whole[:, joint]
    proofs = []
    for sign in (1.0, -1.0):
        recorded = _with(motion, quantity, joint, sign * one)
        if recorded is not None:
            ways = (_with(motion, quantity, joint, sign * way) for way in _joined(one, far))
            proofs += by_motions(recorded, ways)
    if not proofs:
        return None
    best = min(proofs, key=lambda proof: proof.mended)
    return replace(best, recorded=min(proof.recorded for proof in proofs))


def _far_branches(x: NDArray, most: int) -> list[NDArray]:
    """Return which of the values (n,) may be of a branch farther from zero.

    The gap between two branches is wider than any step within one. A magnitude has no sign, so its
    widest gaps, at most so many, are tried.
    """
    values = np.unique(x)
    gaps = np.argsort(np.diff(values))[::-1][:most]
    has_one_sign = bool(len(values) > most > 1 and (values[0] >= 0.0 or values[-1] <= 0.0))
    branches = []
    for k in gaps if has_one_sign else gaps[:1]:
        upper = x > values[k]
        far = upper if abs(values[k + 1]) > abs(values[k]) else ~upper
        within = np.abs(np.diff(x))[upper[1:] == upper[:-1]]
        wide = len(within) > 0 and within.max() < values[k + 1] - values[k]
        # The near branch holds small values, the far one none.
        is_near = np.abs(x[~far]).min() < np.abs(x[far]).min()
        branches += [far] if is_near and (wide or has_one_sign) else []
    return branches


def _joined(x: NDArray, far: NDArray) -> list[NDArray]:
    """Return the ways to read a channel (n,) if its far branch holds the values of the other sign.

    Parameters
    ----------
    x : (n,) array
        As recorded, in any unit.
    far : (n,) bool array
        Where a value is of the branch farther from zero.

    Returns
    -------
    list of (n,) array
        Those that jump less than as recorded from one branch to the other; often none.
    """
    other_sign = -np.sign(np.median(x[~far]))
    ends = (x[far].min(), x[far].max())
    readings = [np.where(far, sign * (x - end), x) for sign in (1.0, -1.0) for end in ends]
    between = far[1:] != far[:-1]

    def jump(values: NDArray) -> float:
        return float(np.abs(np.diff(values))[between].sum())

    return [
        reading
        for reading in readings
        if np.sign(np.median(reading[far])) == other_sign and jump(reading) < jump(x)
    ]


def _with(motion: Motion, quantity: str, joint: int, one: NDArray) -> Motion | None:
    """Return the run with another channel (n,) of a joint; None where it cannot be filtered."""
    whole = motion.torque if quantity == "torque" else motion.measured_angle
    assert whole is not None
    changed = whole.copy()
    changed[:, joint] = one
    if quantity == "torque":
        return replace(motion, torque=changed)
    return mended(motion, angle=changed)

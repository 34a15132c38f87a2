"""Fit a leg with rigid body and friction whose parameters have the signs that nature gives.

Inertia, weight that hangs below its joint, and friction are never negative. A leg whose channels
are exchanged or reversed needs negative ones, so a fit that forbids them shows how the channels are
wired. Each joint is fitted by itself, so that its unit does not matter.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from pipelines.mechanics.mechanisms.leg import LEG, cuff_torque
from pipelines.mechanics.motion import Motion
from pipelines.signals.blocks import BlockAverage

BLOCK_S = 0.1
"""Length of the averages, s. It is long, because noise of the angles would look like acceleration
without torque."""
LEAST_BLOCKS = 50
"""Fewest averages, five seconds of motion, that separate gravity from inertia."""
FROM_POSITIVE = np.array([[1.0, 1, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
"""X1..X4 from (X1 - X2, X2, X3, X4), none of which is negative: M(q) > 0 needs X1 > X2 > 0."""
AS_RECORDED, KNEE_REVERSED, EXCHANGED = (
    ((0, 1), (1.0, 1.0)),
    ((0, 1), (1.0, -1.0)),
    ((1, 0), (1.0, 1.0)),
)
Reading = tuple[tuple[int, int], tuple[float, float]]
"""Which columns are hip and knee, and the sign of each."""


@dataclass(frozen=True)
class Averages:
    """Usable blocks of one run, m of them."""

    motion: Motion
    q: NDArray
    dq: NDArray
    ddq: NDArray
    direction: NDArray
    """(m, 2) mean of sgn dq."""
    torque: NDArray
    cuffs: NDArray | None
    """(m, 2, 3) N, sums of front and back at thigh and shank; None where they were not read."""

    def body(self, reading: Reading = AS_RECORDED) -> NDArray:
        """Return torque per unit of (X1 - X2, X2, X3, X4) under a reading.

        Parameters
        ----------
        reading : Reading, optional
            Order and sign of the channels; as recorded by default.

        Returns
        -------
        (m, 2, 4) array
            N·m per unit.
        """
        order, sign = reading
        q, dq, ddq = (x[:, list(order)] * sign for x in (self.q, self.dq, self.ddq))
        return LEG.regressor(q, dq, ddq, self.motion.geometry) @ FROM_POSITIVE

    def joint_columns(self, joint: int, reading: Reading = AS_RECORDED) -> NDArray:
        """Return the columns of one joint.

        Parameters
        ----------
        joint : int
            0 for the hip, 1 for the knee.
        reading : Reading, optional
            Order and sign of the channels; as recorded by default.

        Returns
        -------
        (m, k) array
            Its share of the rigid body, Coulomb and viscous friction, and an offset of either sign;
            N·m per unit.
        """
        order, sign = reading
        # X1 - X2 and X4 make no torque at the knee.
        body = self.body(reading)[:, joint, slice(1, 3) if joint else slice(None)]
        friction = (
            np.column_stack([self.direction[:, order[joint]], self.dq[:, order[joint]]])
            * sign[joint]
        )
        one = np.ones((len(body), 1))
        # Multiples are never negative, so a free offset needs a column of either sign.
        return np.hstack([body, friction, one, -one])


def averages(motion: Motion) -> Averages | None:
    """Average a motion over its valid blocks.

    Returns
    -------
    Averages or None
        None where the machine has no second drive, or too few blocks are valid.
    """
    is_passive = any(joint.is_passive for joint in motion.machine.joints)
    if motion.machine.mechanism is not LEG or is_passive:
        return None
    block = BlockAverage.lasting(BLOCK_S, motion.sample_rate_hz)
    starts = block.starts(motion.segment)
    starts = starts[block.all(motion.valid, starts)]
    if len(starts) < LEAST_BLOCKS:
        return None
    q, dq, ddq, direction, torque = (
        block.mean(x, starts)
        for x in (motion.q, motion.dq, motion.ddq, np.sign(motion.dq), motion.torque)
    )
    cuffs, forces = None, motion.on_segments
    if forces is not None and motion.geometry.has_cuffs:
        cuffs = block.mean(forces, starts)
    return Averages(motion, q, dq, ddq, direction, torque, cuffs)


def fit(columns: NDArray, torque: NDArray, free: NDArray | None = None) -> tuple[float, NDArray]:
    """Fit torque (m,) by nonnegative multiples of columns (m, p).

    Parameters
    ----------
    columns : (m, p) array
    torque : (m,) array
        N·m.
    free : (m, f) array, optional
        Further columns whose multiples may have any sign.

    Returns
    -------
    float
        Share of the torque's power that is not explained.
    (p,) array
        The multiples.
    """
    # Once free columns are projected out, only columns of known sign remain to be fitted.
    if free is not None:
        basis = np.linalg.qr(free)[0]
        columns, torque = columns - basis @ (basis.T @ columns), torque - basis @ (basis.T @ torque)
    # A root of the Gram matrix has the columns' inner products in a hundredth of their rows.
    everything = np.column_stack([columns, torque])
    # Unit columns keep the eigenvalues comparable, whatever the units.
    scale = np.maximum(np.sqrt(np.einsum("ij,ij->j", everything, everything)), 1e-12)
    power, direction = np.linalg.eigh((everything / scale).T @ (everything / scale))
    root = np.sqrt(np.maximum(power, 0.0))[:, np.newaxis] * direction.T
    # The torque has unit length as well, so the squared misfit is a share of its power.
    multiples, misfit = nnls(root[:, :-1], root[:, -1])
    return misfit**2, multiples * scale[-1] / scale[:-1]


def cuff_misfit(run: Averages, cuffs: NDArray) -> float:
    """Return the share of the cuffs' torque that no limb explains.

    The zeros of the sensors are free.

    Parameters
    ----------
    run : Averages
    cuffs : (m, 2, 3) array
        Sums of front and back at thigh and shank, N.
    """
    g = run.motion.geometry
    measured = cuff_torque(cuffs[:, 0], cuffs[:, 1], run.q, g)
    wide = [np.broadcast_to(unit, (len(measured), 2, 3)) for unit in ZEROS]
    zeros = np.stack([cuff_torque(unit[:, 0], unit[:, 1], run.q, g) for unit in wide], -1)
    # Both joints count alike, though the hip's torque is larger.
    weight = 1.0 / np.maximum(measured.std(axis=0), 1e-12)
    stacked = [
        np.concatenate([x[:, j] * weight[j] for j in range(2)])
        for x in (run.body(), measured, zeros)
    ]
    return fit(stacked[0], stacked[1], stacked[2])[0]


ZEROS = np.array(
    [[[0, 0, 0], [1, 0, 0]], [[0, 0, 0], [0, 1, 0]], [[0, 1, 0], [0, 0, 0]]], dtype=float
)
"""Zeros of the sensors that change the torque: shank along, shank across, thigh across."""

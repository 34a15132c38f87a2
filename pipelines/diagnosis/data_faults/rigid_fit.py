"""Predict the torque of each fifth of a run by a rigid body with friction fitted to the others.

Inertia and friction are never negative, and a leg's weight hangs below its joints. So channels with
a wrong sign, or of another joint, leave an error that no such body explains. A smooth law of each
joint's own angle is fitted as well: springs, counterweights and shifted zeros are no faults. Each
joint is fitted by itself, so that its unit does not matter.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from pipelines.mechanics.mechanisms.leg import cuff_torque
from pipelines.mechanics.mechanisms.single import PENDULUM
from pipelines.mechanics.motion import Motion
from pipelines.signals.blocks import BlockAverage

BLOCK_S = 0.1
"""Length of the averages, s. It is long, because noise of the angles would look like acceleration
without torque."""
LEAST_BLOCKS = 30
"""Fewest averages to which a body is fitted, four fifths of them at a time."""
FROM_POSITIVE = np.array([[1.0, 1, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
"""X1..X4 from (X1 - X2, X2, X3, X4), none of which is negative: M(q) > 0 needs X1 > X2 > 0."""
POWERS = 3
"""Degree of the law of a joint's own angle."""
PARTS = 5
"""Parts of a run, each predicted from the others."""
STRETCHES = 20
"""Stretches of a run that belong to its parts in turn, so that drifts reach all of them, and hardly
any angle occurs in only one."""
AS_RECORDED, KNEE_REVERSED, EXCHANGED = (
    ((0, 1), (1.0, 1.0)),
    ((0, 1), (1.0, -1.0)),
    ((1, 0), (1.0, 1.0)),
)
Reading = tuple[tuple[int, int], tuple[float, float]]
"""Which columns are hip and knee, and the sign of each."""


@dataclass(frozen=True)
class Columns:
    """Torque per unit of each parameter: of those that are never negative, and of the others."""

    positive: NDArray
    """(m, p)."""
    free: NDArray
    """(m, f)."""

    def at(self, rows: NDArray) -> "Columns":
        """Return the columns at some blocks.

        Parameters
        ----------
        rows : (m,) bool array
            Which blocks.
        """
        return Columns(self.positive[rows], self.free[rows])

    def split(self, values: NDArray) -> tuple[NDArray, "Columns"]:
        """Return the torque (m,) of values that are never negative, and the free columns alone."""
        p = self.positive.shape[1]
        return self.positive @ values[:p], Columns(self.positive[:, :0], self.free)

    def torque(self, values: NDArray) -> NDArray:
        """Return the torque (m,) of values (p + f,)."""
        return np.asarray(np.hstack([self.positive, self.free]) @ values)


@dataclass(frozen=True)
class Averages:
    """Usable blocks of one run, m of them; J joints."""

    motion: Motion
    q: NDArray
    dq: NDArray
    ddq: NDArray
    direction: NDArray
    """(m, J) mean of sgn dq."""
    torque: NDArray
    cuffs: NDArray | None
    """(m, 2, 3) N, sums of front and back at thigh and shank; None where they were not read."""

    @property
    def joints(self) -> list[int]:
        """Numbers of the joints whose torque is a reading."""
        joints = self.motion.machine.joints
        return [j for j, joint in enumerate(joints) if joint.has_sensor]

    def body(self, reading: Reading = AS_RECORDED) -> NDArray:
        """Return torque per unit of a leg's (X1 - X2, X2, X3, X4) under a reading.

        Without gravity there is no X4.

        Parameters
        ----------
        reading : Reading, optional
            Order and sign of the channels; as recorded by default.

        Returns
        -------
        (m, 2, 4) array
            N·m per unit; (m, 2, 3) without gravity.
        """
        order, sign = reading
        q, dq, ddq = (x[:, list(order)] * sign for x in (self.q, self.dq, self.ddq))
        columns = self.motion.machine.mechanism.regressor(q, dq, ddq, self.motion.geometry)
        p = columns.shape[2]
        return columns @ FROM_POSITIVE[:p, :p]

    def columns(self, joint: int, reading: Reading = AS_RECORDED) -> Columns:
        """Return the columns of one joint: rigid body, friction, and a law of its own angle.

        Parameters
        ----------
        joint : int
            Number of the joint.
        reading : Reading, optional
            Order and sign of a leg's channels; as recorded by default.
        """
        body, weight = self._body_of(joint, reading)
        order, sign = reading if self.torque.shape[1] > 1 else ((0,), (1.0,))
        channel = order[joint]
        friction = sign[joint] * np.column_stack([self.direction[:, channel], self.dq[:, channel]])
        return Columns(np.hstack([body, friction]), np.hstack([weight, self.own_law(channel)]))

    def _body_of(self, joint: int, reading: Reading) -> tuple[NDArray, NDArray]:
        """Return a joint's columns of parameters that cannot be negative, and of the others."""
        if self.motion.machine.is_leg:
            # X1 - X2 and X4 make no torque at the knee.
            body = self.body(reading)[:, joint, slice(1, 3) if joint else slice(None)]
            return body, body[:, :0]
        mechanism = self.motion.machine.mechanism
        body = mechanism.regressor(self.q, self.dq, self.ddq, self.motion.geometry)[:, joint]
        # One joint's first parameter is its inertia. Its link may be overbalanced.
        inertias = 1 if mechanism.name == PENDULUM.name else 0
        return body[:, :inertias], body[:, inertias:]

    def own_law(self, channel: int) -> NDArray:
        """Return the powers (m, 1 + POWERS) of a joint's own angle, from the constant on."""
        return np.vander(self.q[:, channel], 1 + POWERS, increasing=True)


def averages(motion: Motion, least: int = LEAST_BLOCKS) -> Averages | None:
    """Average a motion over its valid blocks.

    Parameters
    ----------
    motion : Motion
    least : int
        Fewest blocks that are needed.

    Returns
    -------
    Averages or None
        None where too few blocks are valid.
    """
    block = BlockAverage.lasting(BLOCK_S, motion.sample_rate_hz)
    starts = block.starts(motion.segment)
    starts = starts[block.all(motion.valid, starts)]
    if len(starts) < least:
        return None
    q, dq, ddq, direction, torque = (
        block.mean(x, starts)
        for x in (motion.q, motion.dq, motion.ddq, np.sign(motion.dq), motion.torque)
    )
    cuffs, forces = None, motion.on_segments
    if forces is not None and motion.geometry.has_cuffs:
        cuffs = block.mean(forces, starts)
    return Averages(motion, q, dq, ddq, direction, torque, cuffs)


def pooled(runs: Sequence[Averages]) -> Averages:
    """Return the blocks of several runs of one machine as those of its first run, without cuffs."""
    q, dq, ddq, direction, torque = (
        np.concatenate([getattr(run, name) for run in runs])
        for name in ("q", "dq", "ddq", "direction", "torque")
    )
    return Averages(runs[0].motion, q, dq, ddq, direction, torque, cuffs=None)


def fit(columns: Columns, torque: NDArray) -> NDArray:
    """Fit torque by columns, some of whose values cannot be negative.

    Parameters
    ----------
    columns : Columns
        Of m blocks.
    torque : (m,) array
        N·m.

    Returns
    -------
    (p + f,) array
        The values.
    """
    everything = np.column_stack([columns.positive, columns.free, torque])
    # Unit columns keep the eigenvalues comparable, whatever the units.
    scale = np.maximum(np.sqrt(np.einsum("ij,ij->j", everything, everything)), 1e-12)
    gram = (everything / scale).T @ (everything / scale)
    # Over small angles gravity is nearly a law of the angle: without a penalty, rounding would
    # choose huge parts of the torque that cancel. A part of 10,000 times the whole torque costs as
    # much as to explain nothing.
    ridge = 1e-8
    gram[np.diag_indices(len(gram) - 1)] += ridge
    p = columns.positive.shape[1]
    kept, free = np.r_[:p, len(gram) - 1], np.s_[p : len(gram) - 1]
    # Once free columns are projected out, only columns of known sign remain to be fitted.
    by_free = np.linalg.solve(gram[free, free], gram[free][:, kept])
    power, direction = np.linalg.eigh(gram[np.ix_(kept, kept)] - gram[kept, free] @ by_free)
    # A root of the Gram matrix has the columns' inner products in a hundredth of their rows.
    root = np.sqrt(np.maximum(power, 0.0))[:, np.newaxis] * direction.T
    positive = nnls(root[:, :-1], root[:, -1])[0] if p else np.empty(0)
    values = np.concatenate([positive, by_free[:, -1] - by_free[:, :-1] @ positive])
    return values * scale[-1] / scale[:-1]


def joined(columns: Sequence[Columns]) -> Columns:
    """Return the columns of several runs, one after the other."""
    return Columns(
        np.vstack([one.positive for one in columns]), np.vstack([one.free for one in columns])
    )


def predicted(columns: Columns, torque: NDArray) -> NDArray:
    """Return the torque (m,) N·m of each part of the blocks by the values fitted to the others."""
    part = np.arange(len(torque)) * STRETCHES // len(torque) % PARTS
    result = np.empty(len(torque))
    for k in range(PARTS):
        own = part == k
        result[own] = columns.at(own).torque(fit(columns.at(~own), torque[~own]))
    return result


def cuff_columns(run: Averages, cuffs: NDArray) -> tuple[Columns, NDArray]:
    """Return the columns of a limb in the cuffs, and the torque of the cuffs on it.

    The zeros of the sensors are free. The rows of the hip come before those of the knee.

    Parameters
    ----------
    run : Averages
    cuffs : (m, 2, 3) array
        Sums of front and back at thigh and shank, N.

    Returns
    -------
    Columns
        Of 2 m rows, without unit.
    (2 m,) array
        The torque over its scatter at each joint, so that both joints count alike.
    """
    g = run.motion.geometry
    measured = cuff_torque(cuffs[:, 0], cuffs[:, 1], run.q, g)
    wide = [np.broadcast_to(unit, (len(measured), 2, 3)) for unit in ZEROS]
    zeros = np.stack([cuff_torque(unit[:, 0], unit[:, 1], run.q, g) for unit in wide], -1)
    weight = 1.0 / np.maximum(measured.std(axis=0), 1e-12)
    body, torque, free = (
        np.concatenate([x[:, j] * weight[j] for j in range(2)])
        for x in (run.body(), measured, zeros)
    )
    return Columns(body, free), torque


ZEROS = np.array(
    [[[0, 0, 0], [1, 0, 0]], [[0, 0, 0], [0, 1, 0]], [[0, 1, 0], [0, 0, 0]]], dtype=float
)
"""Zeros of the sensors that change the torque: shank along, shank across, thigh across."""

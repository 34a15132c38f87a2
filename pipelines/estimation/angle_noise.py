"""Noise of the angles: accelerations that no torque goes with let every fit take the machine for
too light.

Where the motion nearly cancels what its torques would be, as in a free swing, little noise is
enough. What the angles hold above a low cut-off is either motion, which takes torque, or noise,
which takes none: so the torque that the slow motion's fit foretells from that part alone is held
against the torque that was measured.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from pipelines.estimation.regression import block_average, padding, regress
from pipelines.mechanics.motion import Piece
from pipelines.mechanics.run import Run, kinds_of
from pipelines.mechanics.slow_motion import below, edge
from pipelines.model import Model, ParameterLayout, baseline

CUTOFF_HZ = 5.0
LOOKED_S = 600.0
"""How much of a run that is read piece by piece is looked at: encoders shake as much in ten minutes
as in a day."""
REAL = 0.5
"""Share of the foretold torque that must be measured: 1 where the fast part is motion, 0 where it
is noise."""
LOUD = 1.0
"""Times by which noise must outdo, rms, all that the slow motion's fit leaves: being less than half
of the error's power, it biases little."""
IN_WORDS = f"above {CUTOFF_HZ:g} Hz the angles hold accelerations that no torque goes with: noise"


def is_loud(runs: Sequence[Run]) -> bool:
    """Tell whether noise of the angles outdoes, at any joint of the runs to train, all else that a
    fit leaves."""
    effects = baseline(runs[0].machine, kinds_of(runs))
    model, layout = Model.of(effects), ParameterLayout.of(effects)
    body = layout.bodies.ravel()
    grams = []
    for piece in (piece for run in runs for piece in _beginning(run)):
        if piece.motion.cutoff_hz <= CUTOFF_HZ:
            return False
        grams.append(_gram(piece, model, body))
    return _outdoes(np.sum(grams, axis=0), layout.size, body)


def _beginning(run: Run) -> Iterator[Piece]:
    """Yield a run's pieces, with what the filters need to both sides, until enough of it was looked
    at."""
    rate, seen = run.sample_rate_hz, 0
    for piece in run.pieces(edge(rate, CUTOFF_HZ) + padding(run) + block_average(run).decimation):
        yield piece
        seen += piece.core.stop - piece.core.start
        if seen > LOOKED_S * rate:
            return


def _gram(piece: Piece, model: Model, body: NDArray) -> NDArray:
    """Return the Gram matrix of each joint, (J, c, c): the slow motion's columns, the bodies' fast
    part, the torque."""
    fast = regress(piece, model)
    slow = regress(piece._replace(motion=below(piece.motion, CUTOFF_HZ)), model)
    usable = fast.usable & slow.valid[:, np.newaxis]
    extra = (fast.regressor - slow.regressor)[..., body]
    rows = (
        np.concatenate([slow.regressor, extra, fast.torque[..., np.newaxis]], axis=2)
        * usable[..., np.newaxis]
    )
    return np.einsum("mji,mjk->jik", rows, rows)


def _outdoes(gram: NDArray, p: int, body: NDArray) -> bool:
    """Fit the slow motion, p columns, and hold what it foretells of the fast part against what was
    measured of it."""
    slow, fast = gram[:, :p, :p], gram[:, p:-1, p:-1]
    torque = gram[:, -1, -1]
    # A joint whose torque is nought all along tells nothing; what fits it refuses it.
    weights = np.divide(1.0, torque, out=np.zeros_like(torque), where=torque > 0.0)
    normal, right = np.einsum("j,jik->ik", weights, slow), weights @ gram[:, :p, -1]
    size = np.sqrt(np.maximum(np.diag(normal), np.finfo(float).tiny))
    values = np.linalg.lstsq(normal / np.outer(size, size), right / size, rcond=None)[0] / size
    inertial = values[body]
    power = np.einsum("i,jik,k->j", inertial, fast, inertial)
    measured = (gram[:, p:-1, -1] - gram[:, p:-1, :p] @ values) @ inertial
    residual = (
        torque - 2.0 * gram[:, :p, -1] @ values + np.einsum("i,jik,k->j", values, slow, values)
    )
    return bool(np.any((measured < REAL * power) & (power > LOUD**2 * residual)))

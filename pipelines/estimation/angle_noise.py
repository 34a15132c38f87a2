"""Detect noise of the angles, which biases the inertia of every fit towards zero.

Little noise suffices if the motion nearly cancels its torques, as a free swing does. Angles above a
low cut-off are either motion, which needs torque, or noise, which needs none. So the torque that
the slow motion's fit predicts from the fast part alone is compared with the measured torque.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from pipelines.estimation.regression import block_average, padding, regress
from pipelines.mechanics.motion import Piece
from pipelines.mechanics.run import Run, kinds_of
from pipelines.mechanics.slow_motion import below
from pipelines.mechanics.stretches import edge
from pipelines.model import Model, ParameterLayout, baseline

CUTOFF_HZ = 5.0
"""Frequency that separates slow from fast motion."""
IN_WORDS = f"above {CUTOFF_HZ:g} Hz the angles are mostly noise"


def is_loud(runs: Sequence[Run]) -> bool:
    """Return whether noise of the angles exceeds the residual of the slow motion's fit.

    Parameters
    ----------
    runs : sequence of Run
        Training runs. Only the beginning of each is read.

    Returns
    -------
    bool
        True if it does at one joint or more; False where a run was filtered at ``CUTOFF_HZ`` or
        below.
    """
    effects = baseline(runs[0].machine, kinds_of(runs))
    model, layout = Model.of(effects), ParameterLayout.of(effects)
    # Noise of the angles enters through the acceleration, which only the bodies' columns hold.
    body = layout.bodies.ravel()
    grams = []
    for piece in (piece for run in runs for piece in _beginning(run)):
        # Such a filter has removed the band in which noise could be seen.
        if piece.motion.cutoff_hz <= CUTOFF_HZ:
            return False
        grams.append(_gram(piece, model, body))
    return _outdoes(np.sum(grams, axis=0), layout.size, body)


def _beginning(run: Run) -> Iterator[Piece]:
    """Yield a run's pieces, with margins for the filters, until enough of it was examined."""
    # Length of a run that is examined if it is read piece by piece; encoder noise does not change
    # with time.
    looked_s = 600.0
    rate, seen = run.sample_rate_hz, 0
    # The margin covers the low-pass, the padding of reversals, and a block that ends outside.
    for piece in run.pieces(edge(rate, CUTOFF_HZ) + padding(run) + block_average(run).decimation):
        yield piece
        seen += piece.core.stop - piece.core.start
        if seen > looked_s * rate:
            return


def _gram(piece: Piece, model: Model, body: NDArray) -> NDArray:
    """Return the Gram matrix of each joint, (J, c, c).

    Its columns are those of the slow motion, the bodies' fast part, and the torque.
    """
    fast = regress(piece, model)
    slow = regress(piece._replace(motion=below(piece.motion, CUTOFF_HZ)), model)
    # The slow motion is invalid near gaps, where the low-pass lacks one side.
    usable = fast.usable & slow.valid[:, np.newaxis]
    extra = (fast.regressor - slow.regressor)[..., body]
    rows = (
        # The unfiltered torque serves both parts: the products with fast columns use its fast part.
        np.concatenate([slow.regressor, extra, fast.torque[..., np.newaxis]], axis=2)
        * usable[..., np.newaxis]
    )
    # Products add up over pieces, so that a long run needs no more memory.
    return np.einsum("mji,mjk->jik", rows, rows)


def _outdoes(gram: NDArray, p: int, body: NDArray) -> bool:
    """Fit the slow motion, p columns, and compare predicted and measured fast torque."""
    # Least share of the predicted torque that must be measured: it is 1 if the fast part is motion,
    # 0 if it is noise.
    real = 0.5
    # Least ratio of the noise torque to the slow fit's residual, rms. Less is under half of the
    # error's power, and biases little.
    loud = 1.0
    slow, fast = gram[:, :p, :p], gram[:, p:-1, p:-1]
    torque = gram[:, -1, -1]
    # Joints count by the inverse power of their torque, as their noise is not known yet.
    # A joint whose torque is always zero has no weight here; the fit itself refuses it.
    weights = np.divide(1.0, torque, out=np.zeros_like(torque), where=torque > 0.0)
    normal, right = np.einsum("j,jik->ik", weights, slow), weights @ gram[:, :p, -1]
    # Units differ by orders of magnitude, so columns are scaled before the solve.
    size = np.sqrt(np.maximum(np.diag(normal), np.finfo(float).tiny))
    values = np.linalg.lstsq(normal / np.outer(size, size), right / size, rcond=None)[0] / size
    inertial = values[body]
    # Power of the torque that the fast part requires, and its product with the measured residual.
    # The second equals the first if the fast part is motion, and is zero if it is noise.
    power = np.einsum("i,jik,k->j", inertial, fast, inertial)
    measured = (gram[:, p:-1, -1] - gram[:, p:-1, :p] @ values) @ inertial
    # The residual's square from products alone: |b|² - 2 b'A v + v'A'A v.
    residual = (
        torque - 2.0 * gram[:, :p, -1] @ values + np.einsum("i,jik,k->j", values, slow, values)
    )
    return bool(np.any((measured < real * power) & (power > loud**2 * residual)))

"""Average blocks over 0.1 s: the band in which the decision is made.

The averages pass frequencies below 4.4 Hz. Between that and the angle's own filter the torque holds
the drive's response to counted angles: it repeats with the motion, and no model predicts it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from pipelines.diagnosis.evidence.observed_run import Run

LENGTH_S = 0.1
"""Length of one average, s."""


@dataclass(frozen=True)
class DecisionBand:
    """The averages of one run: M of them, each over a few adjacent blocks without a gap."""

    run: Run
    time: NDArray
    """(M,) s, the middle of each average."""
    blocks: NDArray
    """(M, k) the blocks in each average."""
    weight: NDArray
    """(M, O) share of usable blocks; zero where too few are usable."""
    operators: tuple[sparse.csr_matrix, ...]
    """For each output, (M, m): maps blocks to averages of the usable ones."""

    @classmethod
    def of(cls, run: Run) -> "DecisionBand":
        """Place the averages over a run's blocks, starting again after each gap.

        Parameters
        ----------
        run : Run
            m blocks.
        """
        width = run.block.decimation / run.motion.sample_rate_hz
        k = max(1, round(LENGTH_S / width))
        breaks = np.flatnonzero(np.diff(run.time) > 1.5 * width) + 1
        ends = [*breaks, len(run.time)]
        starts = [np.arange(a, b - k + 1, k) for a, b in zip([0, *breaks], ends, strict=True)]
        blocks = np.concatenate(starts)[:, np.newaxis] + np.arange(k)
        usable = run.usable[blocks]
        count = usable.sum(axis=1)
        # Share of an average's blocks that must be usable.
        least_share = 0.5
        # Near a reversal an average has fewer blocks, more noise, and so less weight.
        weight = np.where(count >= least_share * k, count / k, 0.0)
        operators = tuple(
            _averaging(blocks, usable[:, :, o], count[:, o], len(run.time))
            for o in range(run.usable.shape[1])
        )
        return cls(run, run.time[blocks].mean(axis=1), blocks, weight, operators)

    def average(self, values: NDArray) -> NDArray:
        """Average values of blocks over the usable ones.

        Parameters
        ----------
        values : (m, O, ...) array
            Values at each block and output.

        Returns
        -------
        (M, O, ...) array
            In the unit of ``values``.
        """
        # An output that was not measured is NaN, which a weight of zero would not remove.
        finite = np.nan_to_num(values)
        return np.stack([op @ finite[:, o] for o, op in enumerate(self.operators)], axis=1)


def _averaging(blocks: NDArray, usable: NDArray, count: NDArray, m: int) -> sparse.csr_matrix:
    """Return the (M, m) matrix that averages usable blocks."""
    M, k = blocks.shape
    weights = np.where(usable, 1.0 / np.maximum(count, 1)[:, np.newaxis], 0.0)
    rows = np.repeat(np.arange(M), k)
    return sparse.csr_matrix((weights.ravel(), (rows, blocks.ravel())), shape=(M, m))

"""Combine all searched runs in the decision band into one weighted regression.

Rows are averages over 0.1 s of every output of every run, divided by their noise and whitened as
noise of first order; so the squared length of a residual is a chi-square. The baseline is projected
out of everything, which equals a flat prior on its parameters.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import SuperLU, splu

from pipelines.diagnosis.evidence.decision_band import LENGTH_S, DecisionBand
from pipelines.diagnosis.evidence.noise_model import NoiseModel
from pipelines.diagnosis.evidence.observed_run import Run


@dataclass(frozen=True)
class DecisionRegression:
    """N weighted rows: outputs within averages within runs."""

    kinds: tuple[str, ...]
    """The kind of each run."""
    bands: tuple[DecisionBand, ...]
    roots: tuple[NDArray, ...]
    """(M, O) of each run: the root of each row's weight over its noise, 1/(N·m)."""
    operator: sparse.csr_matrix
    """(N, sum of m O): maps the blocks of all runs to weighted rows; rows without weight are left
    out."""
    whitening: sparse.csr_matrix
    """(N, N): subtracts from each average the noise that the one before it predicts."""
    weighty: NDArray
    """(rows,) whether a row has any weight; N of them do."""
    output: NDArray
    """(N,) the output of each row."""
    torque: NDArray
    """(O,) N·m rms of each output, with which columns become shares."""
    baseline: NDArray
    """(N, b) rows of the baseline."""
    torque_rows: NDArray
    """(N,) the measured torque."""
    basis: NDArray
    """(N, r) orthonormal basis of the baseline."""
    measured: NDArray
    """(N,) the measured torque less its projection on the baseline."""

    @classmethod
    def of(
        cls,
        runs: Sequence[Run],
        baseline: Sequence[NDArray],
        noise: NoiseModel,
        torque: NDArray,
        misfit: NDArray,
    ) -> "DecisionRegression":
        """Build the regression.

        Parameters
        ----------
        runs : sequence of Run
            The runs that are searched.
        baseline : sequence of (m, O, b) arrays
            The baseline's columns in each run.
        noise : NoiseModel
        torque : (O,) array
            Rms of each output, N·m.
        misfit : (O,) array
            Additional noise, because no form of a cause is exact, N·m.
        """
        bands = tuple(DecisionBand.of(run) for run in runs)
        sd, memory = noise.averaged(LENGTH_S)
        sigma = np.hypot(sd, misfit)
        # An output without a known noise was not measured: it has no weight.
        precision = np.where(sigma > 0.0, 1.0 / np.where(sigma > 0.0, sigma, 1.0), 0.0)
        roots = tuple(np.sqrt(band.weight) * precision for band in bands)
        weighty = np.concatenate([root.ravel() for root in roots]) > 0.0
        output = np.concatenate([np.tile(np.arange(len(torque)), len(root)) for root in roots])
        averaging = sparse.block_diag([_operator(b, r) for b, r in zip(bands, roots, strict=True)])
        # The misfit counts as white noise.
        whitening = _whitening(bands, weighty, memory * (sd / sigma) ** 2)
        operator = whitening @ averaging.tocsr()[weighty]
        operator.eliminate_zeros()
        empty = [np.zeros(0)] * 4
        kinds = tuple(run.motion.run for run in runs)
        blank = cls(
            kinds, bands, roots, operator, whitening, weighty, output[weighty], torque, *empty
        )
        rows = blank.rows(baseline)
        measured = blank.rows([run.measured[:, :, np.newaxis] for run in runs])[:, 0]
        basis = _orthonormal(rows)
        residual = measured - basis @ (basis.T @ measured)
        return replace(blank, baseline=rows, torque_rows=measured, basis=basis, measured=residual)

    @property
    def joints(self) -> int:
        """Number of drives; the cuffs' outputs come after them."""
        return len(self.torque) // 2

    @cached_property
    def time(self) -> NDArray:
        """The time of each row, (N,) s."""
        outputs = len(self.torque)
        return np.concatenate([np.repeat(b.time, outputs) for b in self.bands])[self.weighty]

    @cached_property
    def run(self) -> NDArray:
        """The number of each row's run, (N,)."""
        sizes = [root.size for root in self.roots]
        return np.repeat(np.arange(len(sizes)), sizes)[self.weighty]

    @property
    def of_drives(self) -> NDArray:
        """Whether a row is of a drive, (N,) bool."""
        return self.output < self.joints

    def rows(self, parts: Sequence[NDArray]) -> NDArray:
        """Return weighted rows of columns.

        Parameters
        ----------
        parts : sequence of (m, O, k) arrays
            Columns in each run, N·m per unit.

        Returns
        -------
        (N, k) array
            In units of the rows' noise.
        """
        flat = [part.reshape(-1, part.shape[2]) for part in parts]
        return np.asarray(self.operator @ np.concatenate(flat))

    def project(self, columns: NDArray) -> NDArray:
        """Return columns less their projection on the baseline.

        Parameters
        ----------
        columns : (N, k) array
            Weighted rows.

        Returns
        -------
        (N, k) array
            Orthogonal to the baseline.
        """
        return columns - self.basis @ (self.basis.T @ columns)

    @cached_property
    def _inverse(self) -> NDArray:
        """Matrix from rows to the baseline values that come nearest to them, (b, N)."""
        # Columns of equal length: the rank must not depend on the parameters' units.
        size = np.linalg.norm(self.baseline, axis=0)
        size = np.where(size > 0.0, size, 1.0)[:, np.newaxis]
        return np.asarray(np.linalg.pinv(self.baseline / size.T, rcond=1e-9) / size)

    def baseline_values(self, rows: NDArray) -> NDArray:
        """Return the values of the baseline that come nearest to rows.

        Parameters
        ----------
        rows : (N, k) array
            Weighted rows.

        Returns
        -------
        (b, k) array
            In the parameters' units.
        """
        return np.asarray(self._inverse @ rows)

    @cached_property
    def baseline_variance(self) -> NDArray:
        """The variance that each output's noise gives each baseline value, (b, O)."""
        # Rows have unit variance and are independent, so squares of the inverse add up.
        of_output = self.output[:, np.newaxis] == np.arange(len(self.torque))
        return np.asarray(self._inverse**2 @ of_output)

    def series(self, output: int) -> Iterator[tuple[NDArray, NDArray]]:
        """Yield an output's residual in each run under the baseline.

        Parameters
        ----------
        output : int
            Number of the output, drives first.

        Yields
        ------
        tuple of (m,) arrays
            Times, s, and the residual in units of the rows' noise.
        """
        ends = np.cumsum([0, *(root.size for root in self.roots)])
        values = np.zeros(len(self.weighty))
        values[self.weighty] = self.measured
        for band, a, b in zip(self.bands, ends[:-1], ends[1:], strict=True):
            known = band.weight[:, output] > 0.0
            yield band.time[known], values[a:b].reshape(band.weight.shape)[known, output]

    @cached_property
    def _coloured(self) -> SuperLU:
        """Factorisation that undoes the whitening."""
        return splu(self.whitening.tocsc(), permc_spec="NATURAL")

    def shares(self, columns: NDArray) -> NDArray:
        """Return rows whose squares add up to a column's squared share of torque.

        The share at a joint is the column's rms over the drive's rms torque.

        Parameters
        ----------
        columns : (N, k) array
            Weighted rows.

        Returns
        -------
        (R, k) array
            Rows of the drives.
        """
        # Whitened rows mix neighbours, but a share is of the torque itself.
        use, columns = self.of_drives, self._coloured.solve(columns)
        roots = np.concatenate([root.ravel() for root in self.roots])[self.weighty][use]
        weight = np.concatenate([band.weight.ravel() for band in self.bands])[self.weighty][use]
        output = self.output[use]
        total = np.bincount(output, weight, minlength=self.joints)[output]
        scale = np.sqrt(weight / total) / self.torque[output] / roots
        return columns[use] * scale[:, np.newaxis]


def _whitening(
    bands: Sequence[DecisionBand], weighty: NDArray, memory: NDArray
) -> sparse.csr_matrix:
    """Return the matrix that whitens averages correlated with the average before, (N, N).

    ``weighty`` (rows,) marks the averages and outputs that count; ``memory`` (O,) is the
    correlation of adjacent averages.
    """
    outputs, number = len(memory), np.cumsum(weighty) - 1
    # The first average of a run, or after a gap, has none before it.
    follows = np.concatenate([np.diff(b.time, prepend=-np.inf) < 1.5 * LENGTH_S for b in bands])
    row = np.flatnonzero(weighty)
    before = np.maximum(row - outputs, 0)
    has = follows[row // outputs] & weighty[before]
    r = np.where(has, np.nan_to_num(memory)[row % outputs], 0.0)
    # The part that is not predicted has variance 1 - r², and is scaled to one again.
    own = 1.0 / np.sqrt(1.0 - r**2)
    N = len(row)
    there = np.flatnonzero(has)
    of_before = sparse.csr_matrix((-(r * own)[there], (there, number[before[there]])), shape=(N, N))
    return (sparse.diags(own) + of_before).tocsr()


def _operator(band: DecisionBand, root: NDArray) -> sparse.csr_matrix:
    """Return the matrix from a run's blocks and outputs, m O, to weighted averages, M O."""
    outputs = root.shape[1]
    weighted = [sparse.diags(root[:, o]) @ op for o, op in enumerate(band.operators)]
    M, m = weighted[0].shape
    parts = []
    for o, op in enumerate(weighted):
        coo = op.tocoo()
        shape = (M * outputs, m * outputs)
        place = (coo.row * outputs + o, coo.col * outputs + o)
        parts.append(sparse.csr_matrix((coo.data, place), shape=shape))
    return sum(parts[1:], start=parts[0])


def _orthonormal(columns: NDArray) -> NDArray:
    """Return an orthonormal basis (N, r) of columns (N, b), without those that add nothing."""
    size = np.linalg.norm(columns, axis=0)
    q, r = np.linalg.qr(columns[:, size > 0.0] / size[size > 0.0])
    # QR invents a direction for a column that depends on those before it but for rounding.
    return q[:, np.abs(np.diag(r)) > 1e-9]

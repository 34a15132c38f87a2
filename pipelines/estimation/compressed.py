"""The rows of a regression in as few as there are columns, from which every fit with one weight a
joint follows.

Rows that come piece by piece are compressed as they pass (Golub and Van Loan, Matrix Computations,
5.3; the triangles of pieces are stacked and made one triangle again, as in Demmel et al., 2012,
SIAM J. Sci. Comput. 34(1)): residuals of any fit have the same square sum in both, and no digits
are lost to squaring.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr

from pipelines.estimation.regression import Regression


@dataclass(frozen=True)
class Compressed:
    """All usable rows of some runs in few, r for each of J joints: ``torque = regressor @
    parameters + noise``."""

    regressor: NDArray
    """(J, r, p)."""
    torque: NDArray
    """(J, r) N·m."""
    count: NDArray
    """(J,) how many rows there were."""

    def select(self, columns: NDArray) -> "Compressed":
        """Return the regression on some of the parameters, (k,) columns."""
        return replace(self, regressor=self.regressor[:, :, columns])

    def with_held(self, columns: NDArray, values: NDArray) -> "Compressed":
        """Return the same rows, less the torque of parameters, (k,) columns, whose values (k,) are
        known."""
        return replace(self, torque=self.torque - self.regressor[:, :, columns] @ values)


def compress(regressions: Iterable[Regression]) -> Compressed:
    """Compress the usable rows of all pieces of some runs."""
    triangles: list[NDArray] = []
    count: NDArray | int = 0
    for r in regressions:
        rows = np.concatenate([r.regressor, r.torque[:, :, np.newaxis]], axis=2)
        triangles = triangles or [np.zeros((0, rows.shape[2]))] * rows.shape[1]
        for j, triangle in enumerate(triangles):
            triangles[j] = qr(np.concatenate([triangle, rows[r.usable[:, j], j]]), mode="r")[0][
                : rows.shape[2]
            ]
        count = count + r.usable.sum(axis=0)
    # Few usable rows make fewer rows than columns; zeros say nothing, and all joints have as many.
    width = triangles[0].shape[1]
    stacked = np.stack([np.pad(t, ((0, width - len(t)), (0, 0))) for t in triangles])
    return Compressed(stacked[:, :, :-1], stacked[:, :, -1], np.asarray(count))


def together(parts: Sequence[Compressed]) -> Compressed:
    """Return the rows of several as one."""
    return Compressed(
        np.concatenate([part.regressor for part in parts], axis=1),
        np.concatenate([part.torque for part in parts], axis=1),
        np.sum([part.count for part in parts], axis=0),
    )


def normal_equations(rows: Compressed, weights: NDArray) -> tuple[NDArray, NDArray]:
    """Return A'WA (p, p) and A'W tau (p,) over all usable rows."""
    gram = np.einsum("j,jri,jrk->ik", weights, rows.regressor, rows.regressor)
    return gram, np.einsum("j,jri,jr->i", weights, rows.regressor, rows.torque)


def residual_rms(rows: Compressed, values: NDArray) -> NDArray:
    """Return the root mean square residual of each joint over usable rows, (J,) N·m."""
    residual = rows.torque - rows.regressor @ values
    return np.sqrt(np.sum(residual**2, axis=1) / np.maximum(rows.count, 1))

"""Invert a normal matrix, and refuse a singular one."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipelines.errors import NotIdentifiable
from pipelines.mechanics.remedies import AT_REST


def inverse(gram: NDArray, names: Sequence[str]) -> NDArray:
    """Return the inverse of a normal matrix.

    Parameters
    ----------
    gram : (p, p) array
        Normal matrix.
    names : sequence of str
        Names of its columns, for the message.

    Returns
    -------
    (p, p) array

    Raises
    ------
    NotIdentifiable
        If the motion does not separate the parameters; the message names them.
    """
    # Condition number of the scaled regressor above which rounding errors decide.
    singular = 1e7
    size = np.sqrt(np.diag(gram))
    if not np.all(size > 0):
        silent = [name for name, s in zip(names, size, strict=True) if s == 0]
        raise NotIdentifiable(
            f"the motion does not excite {', '.join(silent)}: their columns are zero at every"
            f" usable sample. Move every joint in both directions, faster than it sticks; {AT_REST}"
        )
    # Parameters have different units, so only unit columns have a meaningful condition number.
    scaled = gram / np.outer(size, size)
    eigenvalues = np.linalg.eigvalsh(scaled)
    # The normal matrix has the square of the regressor's condition number, hence the root.
    if eigenvalues[0] <= 0 or np.sqrt(eigenvalues[-1] / eigenvalues[0]) > singular:
        # Eigenvalues rise, so the first vector is the combination that the data determine least.
        weight = np.abs(np.linalg.eigh(scaled)[1][:, 0])
        mixed = [names[i] for i in np.argsort(-weight) if weight[i] > 0.3 * weight.max()]
        raise NotIdentifiable(
            f"the motion does not separate {' and '.join(mixed)}: any of them can stand for the"
            f" others. Excite more harmonics, move all joints at once, or record longer; {AT_REST}"
        )
    return np.linalg.inv(scaled) / np.outer(size, size)

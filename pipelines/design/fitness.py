"""Compute the fitness of an excitation, compiled: repair, regressor, Gram matrix, criterion.

A motion takes about 15 us. Loops are written out, because numba takes seconds to compile array
expressions. A candidate is a vector: sine coordinates of hip and knee, cosine coordinates of hip
and knee, and the two mean angles if they are searched too. Coordinates times ``basis`` are the
Fourier coefficients.
"""

import math
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.design.sines import FAST, sines
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.mechanisms.leg import regressor_rows


class Criterion(IntEnum):
    """What a search optimizes, by its name in the settings."""

    log_det = 0
    condition = 1
    scaled_condition = 2


PARAMETERS = 8
"""X1 .. X4, then Coulomb and viscous friction of hip and knee."""


class Problem(NamedTuple):
    """The constants of one search: n harmonics, f free coordinates per joint, N samples."""

    sine: NDArray
    cosine: NDArray
    """(n, N) harmonics over one period."""
    speeds: NDArray
    """(n,) rad/s."""
    basis: NDArray
    """(2, n, f) from coordinates to sine (0) and cosine (1) coefficients."""
    theta0: NDArray
    """(2,) mean angles, unless ``theta0_is_free``."""
    theta0_is_free: bool
    bounds: NDArray
    """(3, 2, 2): angle, velocity, acceleration; hip, knee; low, high."""
    geometry: NDArray
    criterion: int


class Workspace(NamedTuple):
    """Scratch arrays of one evaluation, N samples each."""

    motion: NDArray
    """(6, N): angles, velocities, accelerations of hip and knee."""
    sines: NDArray
    """(4, N): sine and cosine of the hip's angle, then the knee's."""
    columns: NDArray
    """(10, N): the hip's six columns, then the knee's four."""
    coefficients: NDArray
    """(2, 2, n): sine and cosine; hip and knee."""


def problem(
    *,
    omega: float,
    harmonics: int,
    bounds: NDArray,
    geometry: Geometry,
    criterion: str,
    theta0: NDArray | None,
    basis: NDArray,
    samples: int,
) -> Problem:
    """Prepare a search.

    Parameters
    ----------
    omega : float
        Angular frequency of the first harmonic, rad/s.
    harmonics : int
        Number of harmonics, n.
    bounds : (3, J, 2) array
        Lowest and highest angle, velocity and acceleration of each joint, SI units.
    geometry : Geometry
        Lengths and gravity.
    criterion : str
        Name of a ``Criterion``.
    theta0 : (J,) array or None
        Mean angles, rad; None to search them too.
    basis : (2, n, f) array
        Columns that span the searched coefficients, ``search.basis_of``.
    samples : int
        Samples per period, N.
    """
    phase = 2.0 * np.pi * np.outer(np.arange(1, harmonics + 1), np.arange(samples) / samples)
    return Problem(
        sine=np.sin(phase),
        cosine=np.cos(phase),
        speeds=omega * np.arange(1.0, harmonics + 1),
        basis=np.ascontiguousarray(basis),
        theta0=bounds[0].mean(axis=1) if theta0 is None else np.array(theta0, dtype=float),
        theta0_is_free=theta0 is None,
        bounds=np.ascontiguousarray(bounds),
        geometry=geometry.array(),
        criterion=Criterion[criterion].value,
    )


@njit(cache=True)
def workspace(problem):
    """Allocate the scratch arrays for one problem.

    Parameters
    ----------
    problem : Problem
        n harmonics, N samples.

    Returns
    -------
    Workspace
        Motion (6, N), sines (4, N), columns (10, N) and coefficients (2, 2, n).
    """
    n, samples = problem.sine.shape
    return Workspace(
        np.empty((6, samples)), np.empty((4, samples)), np.empty((10, samples)), np.empty((2, 2, n))
    )


@njit(cache=True)
def cost(candidate, problem, work):
    """Repair a candidate so that it keeps every bound, and return its cost.

    Parameters
    ----------
    candidate : (D,) array
        Free coordinates; changed in place.
    problem : Problem
        Bounds and criterion.
    work : Workspace
        Scratch arrays.

    Returns
    -------
    float
        The criterion, to be minimized; infinite for a singular regressor.
    """
    expand(candidate, problem, work.coefficients)
    move(problem, work)
    repair(candidate, problem, work)
    fill_columns(problem, work)
    gram = gram_matrix(work.columns)
    if problem.criterion == Criterion.log_det:
        # The search minimizes, and a large determinant is good.
        return -_log_determinant(gram)
    if problem.criterion == Criterion.scaled_condition:
        # Columns have different units; at unit norm, the condition shows the motion alone.
        for i in range(PARAMETERS):
            size = math.sqrt(gram[i, i])
            if size <= 0.0:
                return np.inf
            for j in range(PARAMETERS):
                gram[i, j] /= size
                gram[j, i] /= size
    return _condition_number(gram)


@njit(cache=True)
def costs(candidates, problem):
    """Repair candidates and return their costs.

    Parameters
    ----------
    candidates : (P, D) array
        Changed in place.
    problem : Problem
        Bounds and criterion.

    Returns
    -------
    (P,) array
        The criterion, to be minimized.
    """
    work = workspace(problem)
    result = np.empty(len(candidates))
    for i in range(len(candidates)):
        result[i] = cost(candidates[i], problem, work)
    return result


@njit(cache=True)
def expand(candidate, problem, coefficients):
    """Write the Fourier coefficients of a candidate's coordinates.

    Parameters
    ----------
    candidate : (D,) array
        Free coordinates.
    problem : Problem
        With the basis (2, n, free).
    coefficients : (2, 2, n) array
        Written: sine and cosine, joint, harmonic; rad.
    """
    _, n, free = problem.basis.shape
    for part in range(2):
        for joint in range(2):
            start = (2 * part + joint) * free
            for k in range(n):
                total = 0.0
                for f in range(free):
                    total += problem.basis[part, k, f] * candidate[start + f]
                coefficients[part, joint, k] = total


@njit(**FAST)
def move(problem, work):
    """Compute angle less mean angle, velocity and acceleration over one period.

    Parameters
    ----------
    problem : Problem
        n harmonics, N samples.
    work : Workspace
        ``work.coefficients`` is read, ``work.motion`` (6, N) written.
    """
    work.motion[:] = 0.0
    for joint in range(2):
        q, dq, ddq = work.motion[joint], work.motion[2 + joint], work.motion[4 + joint]
        for k in range(problem.speeds.size):
            a, b = work.coefficients[0, joint, k], work.coefficients[1, joint, k]
            speed, sine, cosine = problem.speeds[k], problem.sine[k], problem.cosine[k]
            for i in range(q.size):
                swing = a * sine[i] + b * cosine[i]
                q[i] += swing
                dq[i] += speed * (a * cosine[i] - b * sine[i])
                ddq[i] -= speed * speed * swing


@njit(cache=True)
def repair(candidate, problem, work):
    """Shrink each joint's motion about its mean angle until it keeps the bounds.

    Every quantity is linear in that scale.

    Parameters
    ----------
    candidate : (D,) array
        Changed in place.
    problem : Problem
        Bounds (3, 2, 2): rad, rad/s and rad/s².
    work : Workspace
        ``work.motion`` (6, N) is changed in place.
    """
    _, n, free = problem.basis.shape
    samples = problem.sine.shape[1]
    for joint in range(2):
        theta0 = problem.theta0[joint]
        if problem.theta0_is_free:
            low, high = problem.bounds[0, joint]
            theta0 = min(max(candidate[4 * free + joint], low), high)
            candidate[4 * free + joint] = theta0
        # One scale for all three quantities, or they would not be one motion.
        scale = 1.0
        for quantity in range(3):
            low, high = _extent(work.motion[2 * quantity + joint], n)
            # Velocity and acceleration of a periodic motion have zero mean.
            mean = theta0 if quantity == 0 else 0.0
            scale = min(scale, room(problem.bounds[quantity, joint, 1] - mean, high))
            scale = min(scale, room(mean - problem.bounds[quantity, joint, 0], -low))
        if scale < 1.0:
            for part in range(2):
                start = (2 * part + joint) * free
                for f in range(start, start + free):
                    candidate[f] *= scale
            for quantity in range(3):
                for i in range(samples):
                    work.motion[2 * quantity + joint, i] *= scale
        # The mean angle comes last, because only the motion about it shrinks.
        for i in range(samples):
            work.motion[joint, i] += theta0


@njit(cache=True)
def room(allowed, reached):
    """Return the scale at which ``reached`` does not exceed ``allowed``."""
    return allowed / reached if reached > allowed else 1.0


@njit(**FAST)
def _extent(x, harmonics):
    """Bound a trigonometric polynomial by N uniform samples over a period.

    Between samples, its size exceeds the largest of them by at most a factor of 1 / cos(pi n / N)
    (Ehlich and Zeller, 1964, Math. Z. 86). Applied about the middle of its range, the bound is
    tighter.
    """
    low, high = x[0], x[0]
    for i in range(1, x.size):
        low = min(low, x[i])
        high = max(high, x[i])
    middle = 0.5 * (low + high)
    half = 0.5 * (high - low) / math.cos(math.pi * harmonics / x.size)
    return middle - half, middle + half


@njit(**FAST)
def fill_columns(problem, work):
    """Compute the regressor's columns that are not zero everywhere.

    Parameters
    ----------
    problem : Problem
        N samples.
    work : Workspace
        ``work.motion`` is read, ``work.columns`` (10, N) written: six of the hip, four of the knee.
    """
    q, sine, columns = work.motion, work.sines, work.columns
    length, gravity = problem.geometry
    sines(q[0], sine[0], sine[1])
    sines(q[1], sine[2], sine[3])
    for i in range(q.shape[1]):
        dq = (q[2, i], q[3, i])
        # sin(q1 + q2) from known sines and cosines costs less than another series.
        sin_leg = sine[0, i] * sine[3, i] + sine[1, i] * sine[2, i]
        hip, knee = regressor_rows(
            sine[0, i], sin_leg, sine[2, i], sine[3, i], dq, (q[4, i], q[5, i]), length, gravity
        )
        for p in range(4):
            columns[p, i] = hip[p]
        columns[4, i] = sign(dq[0])
        columns[5, i] = dq[0]
        columns[6, i] = knee[1]
        columns[7, i] = knee[2]
        columns[8, i] = sign(dq[1])
        columns[9, i] = dq[1]


@njit(**FAST)
def sign(x):
    """Return sgn x."""
    return 1.0 if x > 0.0 else (-1.0 if x < 0.0 else 0.0)


@njit(**FAST)
def gram_matrix(columns):
    """Return A'A / N.

    Parameters
    ----------
    columns : (10, N) array
        Columns of hip and knee, as `fill_columns` writes them.

    Returns
    -------
    (8, 8) array
        Of the eight parameters.
    """
    gram = np.zeros((PARAMETERS, PARAMETERS))
    # Parameters whose columns are not zero in a joint's row.
    of_hip = (0, 1, 2, 3, 4, 5)
    # Rows of hip and knee add up. Only the lower triangle is summed.
    for i in range(6):
        for j in range(i + 1):
            gram[of_hip[i], of_hip[j]] += _dot(columns[i], columns[j])
    of_knee = (1, 2, 6, 7)
    for i in range(4):
        for j in range(i + 1):
            gram[of_knee[i], of_knee[j]] += _dot(columns[6 + i], columns[6 + j])
    for i in range(PARAMETERS):
        for j in range(i + 1):
            gram[i, j] /= columns.shape[1]
            gram[j, i] = gram[i, j]
    return gram


@njit(**FAST)
def _dot(x, y):
    """Return the sum of products; a BLAS call would cost more than 1000 products."""
    total = 0.0
    for i in range(x.size):
        total += x[i] * y[i]
    return total


@njit(cache=True)
def _log_determinant(gram):
    """Return the log of a Gram matrix's determinant by Cholesky factors; -inf if it is singular."""
    factor = gram.copy()
    total = 0.0
    for j in range(len(factor)):
        for k in range(j):
            factor[j, j] -= factor[j, k] ** 2
        if factor[j, j] <= 0.0:
            return -np.inf
        # Before its root, a diagonal element is a factor of the determinant.
        total += math.log(factor[j, j])
        factor[j, j] = math.sqrt(factor[j, j])
        for i in range(j + 1, len(factor)):
            for k in range(j):
                factor[i, j] -= factor[i, k] * factor[j, k]
            factor[i, j] /= factor[j, j]
    return total


@njit(cache=True)
def _condition_number(gram):
    """Return the condition number of A from the eigenvalues of A'A, accurate to about eps cond²."""
    eigenvalues = np.linalg.eigvalsh(gram)
    if eigenvalues[0] <= 0.0:
        return np.inf
    return math.sqrt(eigenvalues[-1] / eigenvalues[0])

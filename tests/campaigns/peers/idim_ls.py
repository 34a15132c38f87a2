"""Plain identification by the inverse dynamic model and least squares, as textbooks have it; no
code of exoid in it.

Khalil and Dombre (2002), Modeling, Identification and Control of Robots, chapter 12: angles through
a zero-phase Butterworth filter and central differences, ordinary least squares on torque, and
intervals from the variance of the residual as if every sample were news.
"""

import time

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from tests.campaigns.blind.excitation import baseline_columns
from tests.campaigns.peers.answer import NAMES, Answer, Log

CUTOFF_HZ = 10.0
EDGE_S = 0.5
"""Left out at both ends, where the filter rings."""


def motion(log: Log) -> tuple[NDArray, NDArray, NDArray]:
    """Filtered angle, velocity and acceleration, (n, 2) each."""
    q = sosfiltfilt(butter(4, CUTOFF_HZ, fs=log.rate_hz, output="sos"), log.angle, axis=0)
    dq = np.gradient(q, log.time, axis=0)
    return q, dq, np.gradient(dq, log.time, axis=0)


def identify(log: Log) -> Answer:
    """Fit a leg's eight parameters to one run."""
    begun = time.process_time()
    edge = round(EDGE_S * log.rate_hz)
    A = baseline_columns(*motion(log), log.length, log.gravity)[edge:-edge].reshape(-1, 8)
    b = log.torque[edge:-edge].ravel()
    values, squares, *_ = np.linalg.lstsq(A, b, rcond=None)
    variance = squares[0] / (len(b) - len(values))
    half_width = 1.96 * np.sqrt(variance * np.diag(np.linalg.inv(A.T @ A)))
    return Answer(
        "IDIM-LS", values, NAMES, values, half_width, np.asarray, time.process_time() - begun
    )

"""A motion at uniform times, where its samples were taken at uneven ones."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from pipelines.mechanics.motion import Motion


def on_even_grid(motion: Motion) -> Motion:
    """Return a motion whose samples are means over uniform cells of time.

    A mean over uneven samples is no mean over time: samples are dense where the clock hurries and
    sparse where it is late. Cells are one period of the sample rate wide; none spans a gap.
    The means of the angle and its derivatives are those of the spline through the filtered angle.
    All other means are those of straight lines between readings.

    Parameters
    ----------
    motion : Motion
        n samples.

    Returns
    -------
    Motion
        m cells; the motion itself if its samples are even.
    """
    chosen = motion.metadata.get("regression_filter") or {}
    if not chosen.get("over_time"):
        return motion
    motion = motion.with_readings_between()
    stretches = [s for s in motion.segments() if _cells(motion, s) > 0]
    parts = [_of_stretch(motion, stretch) for stretch in stretches]
    columns: dict[str, Any] = {
        name: np.concatenate([part[name] for part in parts]) for name in parts[0]
    }
    loads: dict[str, Any] = dict.fromkeys(("load", "limb_load", "body", "limb_body"))
    metadata = {**motion.metadata, "regression_filter": {**chosen, "over_time": False}}
    return replace(motion, **(columns | loads | {"metadata": metadata, "sequence": None}))


def _cells(motion: Motion, stretch: slice) -> int:
    """Return the number of whole cells in a stretch."""
    lasts = float(motion.time[stretch][-1] - motion.time[stretch][0])
    return int(lasts * motion.sample_rate_hz + 1e-6) if stretch.stop - stretch.start > 1 else 0


def _of_stretch(motion: Motion, stretch: slice) -> dict[str, NDArray]:
    """Return the columns of a stretch at the middles of its cells."""
    time, period = motion.time[stretch], 1.0 / motion.sample_rate_hz
    edges = time[0] + period * np.arange(_cells(motion, stretch) + 1)
    edges[-1] = min(edges[-1], time[-1])
    middles = 0.5 * (edges[1:] + edges[:-1])
    angle = CubicSpline(time, motion.q[stretch])
    # Differences at the edges of a cell are its means of the derivative, exactly.
    q, dq, ddq = (
        np.diff(part(edges), axis=0) / period
        for part in (angle.antiderivative(), angle, angle.derivative())
    )
    after = np.searchsorted(time, middles).clip(1, len(time) - 1)
    nearest = after - (time[after] - middles > middles - time[after - 1])
    valid = motion.valid[stretch]
    columns = {
        "time": middles,
        "q": q,
        "dq": dq,
        "ddq": ddq,
        "segment": np.full(len(middles), motion.segment[stretch.start]),
        # A cell is as good as the samples around it.
        "valid": valid[after] & valid[after - 1],
    }
    for name in ("torque", "forces", "reference", "temperature"):
        values = getattr(motion, name)
        if values is not None:
            columns[name] = _mean_of_lines(time, values[stretch], edges)
    # A mean of readings is no reading: it lies between the encoder's counts.
    if motion.measured_angle is not None:
        columns["measured_angle"] = motion.measured_angle[stretch][nearest]
    return columns


def _mean_of_lines(time: NDArray, values: NDArray, edges: NDArray) -> NDArray:
    """Return the means, over cells between edges (m + 1,), of straight lines between values.

    Parameters
    ----------
    time : (n,) array
        Times of the values, s.
    values : (n, ...) array
        In any unit; a NaN makes the cells around it NaN.
    edges : (m + 1,) array
        Within ``time``, s.

    Returns
    -------
    (m, ...) array
        In the unit of ``values``.
    """
    wide = (slice(None), *(np.newaxis,) * (values.ndim - 1))
    steps = np.diff(time)[wide]
    # Missing values must not spread over the integral that follows.
    known = np.nan_to_num(values)
    integral = np.zeros_like(known)
    np.cumsum(0.5 * (known[1:] + known[:-1]) * steps, axis=0, out=integral[1:])
    before = np.searchsorted(time, edges, "right").clip(1, len(time) - 1) - 1
    since = (edges - time[before])[wide]
    slope = (known[before + 1] - known[before]) / steps[before]
    at_edges = integral[before] + since * known[before] + 0.5 * since**2 * slope
    means = np.diff(at_edges, axis=0) / np.diff(edges)[wide]
    missing = np.isnan(values)
    if missing.any():
        lacking = np.concatenate([np.zeros_like(missing[:1]), missing]).cumsum(axis=0)
        # The readings from the last one before a cell to the first one behind it.
        last = (before[1:] + 2).clip(max=len(time))
        means[lacking[last] > lacking[before[:-1]]] = np.nan
    return means

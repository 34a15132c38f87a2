"""Compute a motion from a recording: filtered angles, derivatives, segments, valid samples."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray
from scipy.interpolate import Akima1DInterpolator, CubicSpline

from pipelines.contracts.joints import Joint
from pipelines.contracts.table import Rows, Table
from pipelines.contracts.windows import Window, windows
from pipelines.errors import InputError, about
from pipelines.mechanics.stretches import Stretches, edge, find_stretches
from pipelines.settings.filter import FilterSettings
from pipelines.signals.blocks import BlockAverage
from pipelines.signals.cutoff import Cutoff, choose_cutoff
from pipelines.signals.low_pass import derivative, low_pass, reach, shortest

SPLINE_REACH = 40
"""Samples over which a cut influences a cubic spline; the influence falls by 3.7 with each."""
WINDOW = 2**16
"""Rows that are filtered at a time; the filter's margin should be a small part of them."""


@dataclass(frozen=True)
class FilteredRecording:
    """A ``motion/1`` table that is computed window by window, each time its rows are read."""

    recording: Rows
    metadata: dict[str, Any]
    """The recording's metadata, with the filter's."""
    cutoff: Cutoff
    stretches: Stretches

    @property
    def path(self) -> Path | None:
        """The recording's file."""
        return self.recording.path

    @property
    def joints(self) -> tuple[Joint, ...]:
        """Joints of the recording."""
        return self.recording.joints

    def pieces(self, columns: Sequence[str] | None = None) -> Iterator[pa.Table]:
        """Yield the motion in order.

        The margin of each window is long enough that the result equals filtering everything at
        once.

        Parameters
        ----------
        columns : sequence of str, optional
            Names of columns; all by default.

        Yields
        ------
        pyarrow.Table
            Rows of ``motion/1``.
        """
        rate_hz, order = self.metadata["sample_rate_hz"], self.metadata["filter"]["order"]
        margin = reach(rate_hz, self.cutoff.hz, order) + SPLINE_REACH
        # Windows shorter than their margins would mostly filter rows that are dropped.
        for window in windows(self.recording.pieces(), max(WINDOW, margin), margin):
            table = window.kept(self._filtered(window))
            yield table if columns is None else table.select(list(columns))

    def _filtered(self, window: Window) -> pa.Table:
        rows, rate_hz = window.rows, float(self.metadata["sample_rate_hz"])
        time, angle = _time_and_angle(rows, self.joints)
        q, dq, ddq = angle.copy(), np.zeros_like(angle), np.zeros_like(angle)
        segment, valid = np.zeros(len(time), dtype=np.int64), np.zeros(len(time), dtype=bool)
        # Half a sample less, as times are rounded.
        edge_s = (edge(rate_hz, self.cutoff.hz) - 0.5) / rate_hz
        # A stretch that lies only in the margin may be too short to filter; it is dropped.
        first, last = window.first + window.core.start, window.first + window.core.stop
        # One that ends at the first row, or begins at the last, does not overlap the core.
        overlapping = range(
            int(np.searchsorted(self.stretches.stop, first, "right")),
            int(np.searchsorted(self.stretches.start, last, "left")),
        )
        for s in overlapping:
            here = _rows_of(s, self.stretches, window)
            segment[here] = s
            if self.stretches.lasting(rate_hz)[s] < shortest(rate_hz, self.cutoff.hz):
                continue
            grid = _Grid(self.stretches, s, rate_hz)
            q[here], dq[here], ddq[here] = grid.filtered(
                time[here], angle[here], self.cutoff.hz, self.metadata["filter"]["order"]
            )
            # Samples near an end of the stretch are invalid, as the filter lacks one side there.
            begin_s, end_s = self.stretches.origin_s[s] + edge_s, self.stretches.end_s[s] - edge_s
            valid[here] = (time[here] > begin_s) & (time[here] < end_s)
        return _motion_columns(rows, self.joints, (q, dq, ddq), segment, valid)


def filtered(recording: Rows, settings: FilterSettings) -> FilteredRecording:
    """Compute the ``motion/1`` table of a ``recording/1`` table.

    Angles are filtered and differentiated. Torque, forces and the rest stay as measured, and no
    sample is dropped.

    Parameters
    ----------
    recording : Rows
        Rows of ``recording/1``, in memory or on disk.
    settings : FilterSettings
        Cut-off, Hz, or how to choose it; order; length of a block, s.

    Returns
    -------
    FilteredRecording
        Computed each time its rows are read.

    Raises
    ------
    InputError
        The times do not fit the sample rate, or every stretch is too short for the filter.
    """
    rate_hz = float(recording.metadata["sample_rate_hz"])
    with about(recording.path):
        _refuse_strange_rate(rate_hz, "imported" in recording.metadata)
        stretches = find_stretches(
            (piece["time_s"].to_numpy() for piece in recording.pieces(["time_s"])), rate_hz
        )
        cutoff = _cutoff(recording, stretches, rate_hz, settings)
        _refuse_stretches_that_are_all_edge(stretches, rate_hz, cutoff)
    how = {
        "kind": "butterworth_zero_phase",
        "order": settings.order,
        "cutoff_hz": cutoff.hz,
        "why": cutoff.reason,
    }
    block = BlockAverage.lasting(settings.block_s, rate_hz).as_metadata(rate_hz)
    if stretches.uneven:
        block["over_time"] = True
    metadata = recording.metadata | {"filter": how, "regression_filter": block}
    return FilteredRecording(recording, metadata, cutoff, stretches)


def _refuse_strange_rate(rate_hz: float, imported: bool) -> None:
    # Motion below 5 Hz is visible in all of these; a higher rate is a misread clock.
    slowest_hz, fastest_hz = 12.0, 1e6
    if not slowest_hz <= rate_hz <= fastest_hz:
        where = "sample_rate_hz in the rig file"
        if imported:
            where = "time.unit in the map, and import again"
        raise InputError(
            f"is sampled at {rate_hz:.4g} Hz, expected {slowest_hz:g} Hz to {fastest_hz / 1e6:g}"
            f" MHz, which show a joint's motion; correct {where}, or record it again"
        )


def motion_table(recording: Table, settings: FilterSettings) -> Table:
    """Return the ``motion/1`` table of a recording in memory.

    Parameters
    ----------
    recording : Table
        A ``recording/1`` table.
    settings : FilterSettings
        As for `filtered`.
    """
    motion = filtered(recording, settings)
    return Table(pa.concat_tables(motion.pieces()).to_pandas(), motion.metadata, recording.path)


def _cutoff(
    recording: Rows, stretches: Stretches, rate_hz: float, settings: FilterSettings
) -> Cutoff:
    # Where a rate changes, the slowest part limits the band of all.
    slowest_hz = stretches.slowest_hz
    if slowest_hz != rate_hz:
        stretches = replace(stretches, uniform=np.zeros(len(stretches), dtype=bool))
    if settings.cutoff_hz == "auto":
        samples = int(stretches.lasting(slowest_hz)[stretches.longest])
        if samples < 2 * shortest(slowest_hz, slowest_hz / 8):
            raise InputError(
                f"the longest stretch without a gap has {_count(samples)}, too few to choose a"
                " cut-off from; record longer runs, or set filter.cutoff_hz"
            )
        names = tuple(joint.name for joint in recording.joints)
        # A grid between uneven samples may have one point less.
        samples -= not stretches.uniform[stretches.longest]
        pieces = _on_grid(recording, stretches, slowest_hz)
        return choose_cutoff(pieces, samples, slowest_hz, names)
    if settings.cutoff_hz >= slowest_hz / 2:
        raise InputError(
            f"filter.cutoff_hz is {settings.cutoff_hz:g}, expected less than half the sample rate"
            f" of {slowest_hz:g} Hz; lower it"
        )
    return Cutoff(settings.cutoff_hz, "set by hand")


def _refuse_stretches_that_are_all_edge(
    stretches: Stretches, rate_hz: float, cutoff: Cutoff
) -> None:
    rows = edge(rate_hz, cutoff.hz)
    longest = int(stretches.lasting(rate_hz)[stretches.longest])
    # Both edges are invalid, so that not one valid sample would remain.
    if longest <= 2 * rows or longest < shortest(rate_hz, cutoff.hz):
        raise InputError(
            f"no stretch without a gap lasts the {2 * rows / rate_hz:.2f} s that a {cutoff.hz:.1f}"
            f" Hz filter needs; the longest has {_count(longest)}: record longer runs, or raise"
            " filter.cutoff_hz"
        )


def _count(samples: int) -> str:
    return "1 sample" if samples == 1 else f"{samples} samples"


def _on_grid(recording: Rows, stretches: Stretches, rate_hz: float) -> Iterator[NDArray]:
    """Yield the angles (n, J) of the longest stretch at uniform times."""
    s = stretches.longest
    grid = _Grid(stretches, s, rate_hz)
    names = ["time_s", *(joint.column("angle") for joint in recording.joints)]
    for window in windows(recording.pieces(names), WINDOW, SPLINE_REACH):
        time, angle = _time_and_angle(window.rows, recording.joints)
        here = _rows_of(s, stretches, window)
        first, last = max(here.start, window.core.start), min(here.stop, window.core.stop)
        if first < last:
            # Half-open intervals, so that a grid point at a window's border is counted once.
            ends = window.first + last == stretches.stop[s]
            yield grid.between(time[here], angle[here], time[first], np.inf if ends else time[last])


def _rows_of(s: int, stretches: Stretches, window: Window) -> slice:
    """Return the rows of a stretch within a window."""
    ends = np.array([stretches.start[s], stretches.stop[s]]) - window.first
    return slice(*np.clip(ends, 0, window.rows.num_rows).tolist())


def _time_and_angle(rows: pa.Table, joints: Sequence[Joint]) -> tuple[NDArray, NDArray]:
    return rows["time_s"].to_numpy(), np.column_stack(
        [rows[joint.column("angle")].to_numpy() for joint in joints]
    )


def _motion_columns(
    rows: pa.Table,
    joints: Sequence[Joint],
    states: Sequence[NDArray],
    segment: NDArray,
    valid: NDArray,
) -> pa.Table:
    """Combine computed and recorded columns in the order of ``motion/1``."""
    columns: dict[str, Any] = {"time_s": rows["time_s"]}
    q, dq, ddq = states
    for j, joint in enumerate(joints):
        columns[joint.column("angle")] = q[:, j]
        columns[joint.column("angle_measured")] = rows[joint.column("angle")]
        columns[joint.column("velocity")] = dq[:, j]
        columns[joint.column("acceleration")] = ddq[:, j]
        if joint.column("velocity") in rows.column_names:
            columns[joint.column("velocity_measured")] = rows[joint.column("velocity")]
    columns |= {name: rows[name] for name in rows.column_names if name not in columns}
    return pa.table({**columns, "segment": segment, "valid": valid})


class _Grid:
    """Uniform times of one stretch, on which the filter is defined."""

    def __init__(self, stretches: Stretches, number: int, rate_hz: float) -> None:
        self._origin_s = stretches.origin_s[number]
        self._uniform = stretches.uniform[number]
        # A wrong stamp makes a spline overshoot in the long step next to it, which is no noise that
        # a low-pass averages out. Between nearly even samples a spline is more accurate.
        self._between: Callable[[NDArray, NDArray], Any] = CubicSpline
        if stretches.uneven:
            # The grid ends at a sample, but for rounding.
            self._between = partial(Akima1DInterpolator, method="makima", extrapolate=True)
        self._rate_hz = rate_hz

    def filtered(
        self, time: NDArray, angle: NDArray, cutoff_hz: float, order: int
    ) -> list[NDArray]:
        """Return angle, velocity and acceleration (n, J) at the samples' own times."""
        grid, uniform = self._sampled(time, angle)
        smooth = low_pass(uniform, self._rate_hz, cutoff_hz, order)
        states = [smooth, *(derivative(smooth, self._rate_hz, order) for order in (1, 2))]
        # Torque is known at the samples' own times only, so the motion is needed there, too.
        return states if self._uniform else [CubicSpline(grid, state)(time) for state in states]

    def between(self, time: NDArray, angle: NDArray, begin_s: float, end_s: float) -> NDArray:
        """Return the angles (m, J) at uniform times from ``begin_s`` until before ``end_s``."""
        grid, uniform = self._sampled(time, angle)
        return uniform[(grid >= begin_s) & (grid < end_s)]

    def _sampled(self, time: NDArray, angle: NDArray) -> tuple[NDArray, NDArray]:
        """Return uniform times and the angles there; the samples themselves if they are uniform."""
        if self._uniform:
            return time, angle
        # Counted from the stretch's start, so that all windows use the same grid.
        first = int(np.ceil((time[0] - self._origin_s) * self._rate_hz))
        last = int((time[-1] - self._origin_s) * self._rate_hz)
        grid = self._origin_s + np.arange(first, last + 1) / self._rate_hz
        return grid, np.asarray(self._between(time, angle)(grid))

"""A run to fit or to validate, either in memory or read piece by piece from its file."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from pipelines.contracts.joint_units import Scale
from pipelines.contracts.joints import Joint
from pipelines.contracts.table import Rows, Table
from pipelines.contracts.windows import windows
from pipelines.errors import InputError
from pipelines.mechanics.even_grid import on_even_grid
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.machine import Machine
from pipelines.mechanics.motion import Motion, Piece, motion_from_table

RUNS = ("exo_alone", "with_human")

WINDOW = 2**16
"""Samples in a piece."""


@dataclass(frozen=True)
class StoredRun:
    """A run of which one piece is in memory at a time."""

    rows: Rows
    """Rows of ``motion/1``."""
    default_geometry: Geometry | None
    file: str
    scales: tuple[Scale, ...] = ()
    """Scale of each joint, as of a motion."""

    @cached_property
    def _first(self) -> pa.Table:
        """The first row, with all columns of the file."""
        return next(iter(self.rows.pieces())).slice(0, 1)

    @cached_property
    def _facts(self) -> Motion:
        """All properties of the run, without samples."""
        return self._motion(self._first.slice(0, 0).select(self._columns))

    @property
    def run(self) -> str:
        """Kind of run."""
        return self._facts.run

    @property
    def purpose(self) -> str:
        """Purpose of the run."""
        return self._facts.purpose

    @property
    def sample_rate_hz(self) -> float:
        """Nominal sample rate."""
        return self._facts.sample_rate_hz

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints."""
        return self._facts.joints

    @property
    def machine(self) -> Machine:
        """The machine that moved."""
        return self._facts.machine

    @property
    def geometry(self) -> Geometry:
        """Geometry of the recording, completed by the default."""
        return self._facts.geometry

    @property
    def metadata(self) -> dict[str, Any]:
        """Metadata of the motion."""
        return self.rows.metadata

    @cached_property
    def _columns(self) -> list[str]:
        """Columns that a fit needs, with temperatures if the file has them."""
        fitted = ("angle", "velocity", "acceleration", "torque")
        quantities = [joint.column(quantity) for quantity in fitted for joint in self.rows.joints]
        read = [joint.column("temperature") for joint in self.rows.joints]
        temperatures = [name for name in read if name in self._first.column_names]
        return ["time_s", *quantities, "segment", "valid", *temperatures]

    def _motion(self, rows: Any) -> Motion:
        table = Table(rows.to_pandas(), self.rows.metadata, Path(self.file))
        return replace(motion_from_table(table, self.default_geometry), scales=self.scales)

    def pieces(self, margin: int) -> Iterator[Piece]:
        """Yield the run in order, piece by piece.

        Parameters
        ----------
        margin : int
            Samples to add on both sides of each piece, as far as there are any.

        Yields
        ------
        Piece
            Of at most ``WINDOW`` rows and the margins.
        """
        if self._even is not None:
            yield from self._even.pieces(margin)
            return
        # First row of the segment in which the next window begins. A filter over blocks counts them
        # from there, so that windows do not shift the blocks.
        begun = 0
        for window in windows(self.rows.pieces(self._columns), WINDOW, margin):
            motion = self._motion(window.rows)
            # np.diff is not zero at a segment's last row, and the next segment begins a row later.
            changes = window.first + 1 + np.flatnonzero(np.diff(motion.segment))
            yield Piece(motion, window.core, window.first - begun)
            # The next window begins a margin before the end of this core.
            following = changes[changes <= window.first + window.core.stop - margin]
            begun = int(following[-1]) if len(following) else begun

    @cached_property
    def _even(self) -> Motion | None:
        """The run at uniform times, all of it in memory; None where its samples are even."""
        chosen = self.rows.metadata.get("regression_filter") or {}
        if not chosen.get("over_time"):
            return None
        return self.whole()

    def whole(self) -> Motion:
        """Return the whole run with every channel in memory, at uniform times."""
        return on_even_grid(self._motion(pa.concat_tables(self.rows.pieces())))


Run = Motion | StoredRun
"""A run to fit or to validate; both kinds have the same properties and methods."""


def refuse_several_machines(runs: Sequence[Run]) -> None:
    """Refuse runs whose joints or geometry differ from the first one's.

    Parameters
    ----------
    runs : sequence of Run
        At least one.

    Raises
    ------
    InputError
        Names both files and their joints or lengths.
    """
    first = runs[0]
    for other in runs[1:]:
        if other.machine.joints != first.machine.joints:
            raise InputError(
                f"{other.file} has joints {_named(other)}, {first.file} has {_named(first)}; give"
                " runs of one machine"
            )
        # The regressor contains only these. Cuff distances may differ, as each run uses its own.
        lengths = ("thigh_length_m",) if first.machine.mechanism.has_length else ()
        for key in (*lengths, "gravity_m_s2"):
            ours, theirs = getattr(first.geometry, key), getattr(other.geometry, key)
            if ours != theirs:
                raise InputError(
                    f"{other.file} has {key} {theirs:g}, {first.file} has {ours:g}; give runs of"
                    " one machine, or correct the metadata"
                )


def _named(run: Run) -> str:
    joints = run.machine.joints
    alike = all(joint == Joint(joint.name) for joint in joints)
    return ", ".join(joint.name if alike else str(joint) for joint in joints)


def kinds_of(runs: Iterable[Run]) -> tuple[str, ...]:
    """Return the kinds of run that occur, exo_alone first."""
    there = {run.run for run in runs}
    return tuple(kind for kind in RUNS if kind in there)

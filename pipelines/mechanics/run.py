"""A run to fit or to judge: all of it in memory, or read piece by piece from where it is stored."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import pyarrow as pa

from pipelines.contracts.table import Rows, Table
from pipelines.contracts.windows import windows
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.machine import Machine
from pipelines.mechanics.motion import Motion, Piece, motion_from_table
from pipelines.mechanics.units import Scale

RUNS = ("exo_alone", "with_human")

WINDOW = 2**16
"""Samples of a piece."""
FITTED = ("angle", "velocity", "acceleration", "torque")


class Run(Protocol):
    """What a fit asks of a run; a ``Motion`` is one."""

    @property
    def run(self) -> str: ...  # noqa: D102
    @property
    def purpose(self) -> str: ...  # noqa: D102
    @property
    def sample_rate_hz(self) -> float: ...  # noqa: D102
    @property
    def joints(self) -> tuple[str, ...]: ...  # noqa: D102
    @property
    def machine(self) -> Machine: ...  # noqa: D102
    @property
    def scales(self) -> tuple[Scale, ...]: ...  # noqa: D102
    @property
    def geometry(self) -> Geometry: ...  # noqa: D102
    @property
    def file(self) -> str: ...  # noqa: D102
    @property
    def metadata(self) -> dict[str, Any]: ...  # noqa: D102
    @property
    def joint_metadata(self) -> list[dict[str, str]]: ...  # noqa: D102

    def pieces(self, margin: int) -> Iterator[Piece]:
        """Yield the run in its order, each piece with ``margin`` samples to both sides."""
        ...

    def whole(self) -> Motion:
        """Return all of it, every channel, in memory."""
        ...


@dataclass(frozen=True)
class StoredRun:
    """A run of which one piece is in memory at a time."""

    rows: Rows
    """``motion/1``."""
    default_geometry: Geometry | None
    file: str
    scales: tuple[Scale, ...] = ()
    """As a motion's."""

    @cached_property
    def _first(self) -> pa.Table:
        """The first row, with every column that there is."""
        return next(iter(self.rows.pieces())).slice(0, 1)

    @cached_property
    def _facts(self) -> Motion:
        """All that is known of the run, without a sample of it."""
        return self._motion(self._first.slice(0, 0).select(self._columns))

    @property
    def run(self) -> str:
        """The kind of run."""
        return self._facts.run

    @property
    def purpose(self) -> str:
        """What the run is for."""
        return self._facts.purpose

    @property
    def sample_rate_hz(self) -> float:
        """Nominal."""
        return self._facts.sample_rate_hz

    @property
    def joints(self) -> tuple[str, ...]:
        """Their names."""
        return self._facts.joints

    @property
    def machine(self) -> Machine:
        """The machine that moved."""
        return self._facts.machine

    @property
    def geometry(self) -> Geometry:
        """The recording's, completed by the default."""
        return self._facts.geometry

    @property
    def metadata(self) -> dict[str, Any]:
        """The motion's."""
        return self.rows.metadata

    @property
    def joint_metadata(self) -> list[dict[str, str]]:
        """What a file computed from this run says of its joints."""
        return self._facts.joint_metadata

    @cached_property
    def _columns(self) -> list[str]:
        """What a fit needs: temperatures too, where they were read."""
        quantities = [joint.column(quantity) for quantity in FITTED for joint in self.rows.joints]
        read = [joint.column("temperature") for joint in self.rows.joints]
        return [
            "time_s",
            *quantities,
            "segment",
            "valid",
            *(c for c in read if c in self._first.column_names),
        ]

    def _motion(self, rows: Any) -> Motion:
        table = Table(rows.to_pandas(), self.rows.metadata, Path(self.file))
        return replace(motion_from_table(table, self.default_geometry), scales=self.scales)

    def pieces(self, margin: int) -> Iterator[Piece]:
        """Yield the run in its order, each piece with ``margin`` samples to both sides."""
        begun = 0
        for window in windows(self.rows.pieces(self._columns), WINDOW, margin):
            motion = self._motion(window.rows)
            changes = window.first + 1 + np.flatnonzero(np.diff(motion.segment))
            yield Piece(motion, window.core, window.first - begun)
            following = changes[changes <= window.first + window.core.stop - margin]
            begun = int(following[-1]) if len(following) else begun

    def whole(self) -> Motion:
        """Return all of it, every channel, in memory."""
        return self._motion(pa.concat_tables(self.rows.pieces()))


def kinds_of(runs: Iterable[Run]) -> tuple[str, ...]:
    """Return the kinds of run there are among some, exo_alone first."""
    there = {run.run for run in runs}
    return tuple(kind for kind in RUNS if kind in there)

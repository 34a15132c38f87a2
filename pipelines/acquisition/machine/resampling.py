"""Resampling of drives that sample by clocks of their own, at the first drive's instants."""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from math import floor

from pipelines.acquisition.machine.reading import Reading
from pipelines.signals.interpolation import cubic_weights

Position = Callable[[int], float | None]
"""From a sample of the first drive to another's fractional sample then; None while unknown."""

INTERPOLATED = tuple(f.name for f in fields(Reading) if f.type in (float, "float"))


class Track:
    """The latest samples of one drive, with interpolation between them."""

    def __init__(self) -> None:
        self._samples: dict[int, Reading] = {}
        self._order: deque[int] = deque()
        self.newest: int | None = None

    def add(self, readings: Sequence[Reading]) -> None:
        """Add samples; those that are not newer are ignored."""
        for reading in readings:
            if self.newest is None or reading.sequence > self.newest:
                self.newest = reading.sequence
                self._samples[reading.sequence] = reading
                self._order.append(reading.sequence)

    def forget(self, before: int) -> None:
        """Discard samples with numbers below ``before``."""
        while self._order and self._order[0] < before:
            del self._samples[self._order.popleft()]

    def waits_for(self, position: float) -> bool:
        """Return whether samples around a position are still to come."""
        # The cubic's last sample is the second one after the position.
        needed = floor(position) + (0 if position == floor(position) else 2)
        return self.newest is None or self.newest < needed

    def at(self, position: float) -> Reading | None:
        """Interpolate the samples at a position.

        By a cubic through the four samples around it, or linearly where an outer one is missing.

        Parameters
        ----------
        position : float
            Fractional sample number of this drive.

        Returns
        -------
        Reading or None
            None where a neighbouring sample is missing.
        """
        base = floor(position)
        x = position - base
        if x == 0.0:
            return self._samples.get(base)
        near = [self._samples.get(base + k) for k in (-1, 0, 1, 2)]
        if near[1] is None or near[2] is None:
            return None
        weights = cubic_weights(x) if near[0] and near[3] else (0.0, 1.0 - x, x, 0.0)
        parts = [
            (weight, reading) for weight, reading in zip(weights, near, strict=True) if reading
        ]
        values = {
            name: sum(weight * getattr(reading, name) for weight, reading in parts)
            for name in INTERPOLATED
        }
        # Number and status cannot be interpolated; they are those of the sample before.
        return replace(near[1], **values)


class Alignment:
    """Rows of all drives at the first drive's instants, as soon as their samples have come."""

    def __init__(self, positions: Sequence[Position]) -> None:
        """Align drives by their positions, one for each drive but the first."""
        self._positions = positions
        # As many may wait for another drive's; the watchdog ends a run long before.
        self._first: deque[Reading] = deque(maxlen=100_000)
        self._tracks = [Track() for _ in positions]

    def rows(self, samples: Sequence[Sequence[Reading]]) -> list[tuple[Reading, ...]]:
        """Add each drive's new samples; return the rows that are complete now.

        A row for which one drive lacks a sample is left out: gaps are not interpolated.

        Parameters
        ----------
        samples : sequence of sequences of Reading
            New samples of each drive, oldest first.

        Returns
        -------
        list of tuples of Reading
            At the first drive's instants, oldest first.
        """
        self._first.extend(samples[0])
        for track, readings in zip(self._tracks, samples[1:], strict=True):
            track.add(readings)
        rows = []
        while self._first:
            positions = [position(self._first[0].sequence) for position in self._positions]
            known = [position for position in positions if position is not None]
            if len(known) < len(positions) or any(
                track.waits_for(position)
                for track, position in zip(self._tracks, known, strict=True)
            ):
                break
            first = self._first.popleft()
            others = [
                track.at(position) for track, position in zip(self._tracks, known, strict=True)
            ]
            row = (first, *(other for other in others if other is not None))
            if len(row) == len(samples):
                rows.append(row)
            for track, position in zip(self._tracks, known, strict=True):
                # Positions increase, and the cubic's first sample is one before the position.
                track.forget(floor(position) - 1)
        return rows

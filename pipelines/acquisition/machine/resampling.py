"""Samples of drives that sample by clocks of their own, brought to the first drive's instants as
they come."""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from math import floor

from pipelines.acquisition.machine.drive import Reading
from pipelines.signals.interpolation import cubic_weights

Position = Callable[[int], float | None]
"""From a sample of the first drive to where another drive is then in its own samples; None while
that is not known."""

CARRIED = tuple(f.name for f in fields(Reading) if f.type in (float, "float"))
MOST_WAITING = 100_000
"""Samples that wait for another drive's, at most; the watchdog ends a run long before."""


class Track:
    """One drive's latest samples, looked up between them."""

    def __init__(self) -> None:
        self._held: dict[int, Reading] = {}
        self._order: deque[int] = deque()
        self.newest: int | None = None

    def add(self, readings: Sequence[Reading]) -> None:
        """Take in samples; one that is there already changes nothing."""
        for reading in readings:
            if self.newest is None or reading.sequence > self.newest:
                self.newest = reading.sequence
                self._held[reading.sequence] = reading
                self._order.append(reading.sequence)

    def forget(self, before: int) -> None:
        """Drop samples that nothing will ask for."""
        while self._order and self._order[0] < before:
            del self._held[self._order.popleft()]

    def waits_for(self, position: float) -> bool:
        """Tell whether samples are still to come that decide what the drive told at a position."""
        needed = floor(position) + (0 if position == floor(position) else 2)
        return self.newest is None or self.newest < needed

    def at(self, position: float) -> Reading | None:
        """Return what the drive told at a place between its samples; None where a sample beside it
        is missing.

        A cubic through the four samples around, a straight line where the outer two are not all
        there.
        """
        base = floor(position)
        x = position - base
        if x == 0.0:
            return self._held.get(base)
        near = [self._held.get(base + k) for k in (-1, 0, 1, 2)]
        if near[1] is None or near[2] is None:
            return None
        weights = cubic_weights(x) if near[0] and near[3] else (0.0, 1.0 - x, x, 0.0)
        parts = [
            (weight, reading) for weight, reading in zip(weights, near, strict=True) if reading
        ]
        values = {
            name: sum(weight * getattr(reading, name) for weight, reading in parts)
            for name in CARRIED
        }
        return replace(near[1], **values)


class Alignment:
    """Rows of all drives at the first drive's instants, each once the other drives' samples around
    it are there."""

    def __init__(self, positions: Sequence[Position]) -> None:
        """Take for each drive but the first where it is at a sample of the first."""
        self._positions = positions
        self._first: deque[Reading] = deque(maxlen=MOST_WAITING)
        self._tracks = [Track() for _ in positions]

    def rows(self, samples: Sequence[Sequence[Reading]]) -> list[tuple[Reading, ...]]:
        """Take in what each drive told since the last time, and return the rows that are whole now.

        A row for which one drive lacks a sample is left out: nothing is invented across a gap.
        """
        self._first.extend(samples[0])
        for track, readings in zip(self._tracks, samples[1:], strict=True):
            track.add(readings)
        rows = []
        while self._first:
            positions = [position(self._first[0].sequence) for position in self._positions]
            places = [place for place in positions if place is not None]
            if len(places) < len(positions) or any(
                track.waits_for(place) for track, place in zip(self._tracks, places, strict=True)
            ):
                break
            first = self._first.popleft()
            others = [track.at(place) for track, place in zip(self._tracks, places, strict=True)]
            row = (first, *(other for other in others if other is not None))
            if len(row) == len(samples):
                rows.append(row)
            for track, place in zip(self._tracks, places, strict=True):
                track.forget(floor(place) - 1)
        return rows

"""Where the samples that are kept come from: the cycle itself, or the drives' own records and
clocks beside it."""

import asyncio
import time
from collections.abc import Awaitable, Callable, Iterator, Sequence
from functools import partial
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from pipelines.acquisition.machine.clock_offset import BUCKET_S, Bounds, Drift
from pipelines.acquisition.machine.drive import Drive, Reading
from pipelines.acquisition.machine.machine import Machine, all_answers
from pipelines.acquisition.machine.resampling import Alignment
from pipelines.acquisition.machine.row import Row
from pipelines.errors import DeviceError, Unanswered

Judge = Callable[[Row, Sequence[Sequence[Reading]], float], list[list[Reading]]]
"""Given a cycle's row, samples of each drive and the host's clock (s), returns those that are new;
raises DeviceError where one is reason to stop."""

SECOND_LOOK = (0.3, 0.65)
"""Shares of a sample after an exchange between which a drive with a clock of its own is looked at
again: with both looks none of its samples passes unseen."""
AIM = 0.1
"""Share of a sample by which that look falls before or after the instant at which the drive's next
one is expected."""


class Sampling(Protocol):
    """Tells which rows are to be kept."""

    async def rows(self, row: Row) -> list[Row]:
        """Return rows that are whole now that a cycle brought this one, oldest first."""

    def end(self) -> None:
        """Ask the drives for nothing more beside the cycle."""

    def clocks(self, since_s: float) -> dict[str, dict]:
        """Return what is known of the drives' clocks, by joint, ``since_s`` of the first one's
        time."""


class Latched:
    """Drives latch their samples at one instant: a cycle's row is kept as it is."""

    async def rows(self, row: Row) -> list[Row]:
        """Return the cycle's row."""
        return [row]

    def end(self) -> None:
        """Do nothing: the cycle alone asks the drives."""

    def clocks(self, since_s: float) -> dict[str, dict]:
        """Return nothing: there is one clock."""
        return {}


class PendingRequest:
    """A request to a drive that goes on beside the cycle, which must not wait for it; one at a
    time."""

    def __init__(self) -> None:
        self._request: asyncio.Task[list[Reading] | DeviceError] | None = None

    @property
    def is_under_way(self) -> bool:
        """Whether a request was begun of which it is not known yet what it brought."""
        return self._request is not None

    @property
    def is_answered(self) -> bool:
        """Whether what it brought is there."""
        return self._request is not None and self._request.done()

    def begin(self, ask: Callable[[], Awaitable[list[Reading]]]) -> None:
        """Begin a request."""
        self._request = asyncio.create_task(self._outcome(ask))

    async def brought(self) -> list[Reading]:
        """Wait for what the request brings, and return it; nothing where there was none, or no
        answer."""
        if self._request is None:
            return []
        samples, self._request = await self._request, None
        if isinstance(samples, DeviceError):
            raise samples
        return samples

    def end(self) -> None:
        """Wait no more: the drive is to be slowed down."""
        if self._request:
            self._request.cancel()

    async def _outcome(
        self, ask: Callable[[], Awaitable[list[Reading]]]
    ) -> list[Reading] | DeviceError:
        try:
            return await ask()
        except Unanswered:
            return []
        except DeviceError as error:
            return error


class Cycled:
    """Samples of one drive that the cycle brought, and a second look at each for a drive with a
    clock of its own."""

    def __init__(self, drive: Drive, period_s: float, *, looks_again: bool) -> None:
        self._drive, self._period_s, self._looks_again = drive, period_s, looks_again
        self._dither = np.random.default_rng(0)
        self.pending = PendingRequest()

    async def samples(self, reading: Reading) -> list[Reading]:
        """Return what came since the last cycle: the second look at the last one, and this one's
        reading."""
        seen = await self.pending.brought()
        if self._looks_again:
            self.pending.begin(self._look_again)
        return [*seen, reading]

    async def _look_again(self) -> list[Reading]:
        """Look at the drive when its next sample is due, or as near to that as is in reach: that
        tells most."""
        low, high = (share * self._period_s for share in SECOND_LOOK)
        due = self._drive.bounds.ahead(time.perf_counter()) if self._drive.bounds else None
        aim = (
            self._dither.uniform(low, high)
            if due is None
            else due + self._dither.normal(0.0, AIM) * self._period_s
        )
        await asyncio.sleep(float(np.clip(aim, low, high)))
        return [await self._drive.look(in_motion=True)]


class Recorded:
    """Samples that one drive kept itself, drained once they fill a read."""

    def __init__(self, drive: Drive) -> None:
        assert drive.ring  # a rig file that asks for recorders has one for every drive
        self._drive, self._block = drive, drive.ring.block
        self._drained: int | None = None
        self.pending = PendingRequest()

    async def samples(self, reading: Reading) -> list[Reading]:
        """Return what was drained since the last cycle; mostly nothing, until a read is worth its
        while."""
        samples = await self.pending.brought() if self.pending.is_answered else []
        is_due = self._drained is None or reading.sequence >= self._drained + self._block
        if is_due and not self.pending.is_under_way:
            self.pending.begin(partial(self._drain, reading.sequence))
            if self._drive.in_lockstep:  # the drives wait
                return samples + await self.pending.brought()
        return samples

    async def _drain(self, newest: int) -> list[Reading]:
        """Drain the ring; of what is not answered it keeps the samples, and the next drain brings
        them."""
        samples = await self._drive.drain(newest)
        self._drained = samples[-1].sequence if samples else newest
        return samples


class Streams:
    """Each drive's samples come by themselves, and are brought to the first one's instants."""

    def __init__(self, machine: Machine, cycle_hz: float, judge: Judge) -> None:
        rig, drives = machine.rig, machine.drives
        self._machine, self._judge = machine, judge
        self._rate_hz = cycle_hz * machine.samples_per_cycle
        self._own = rig.clocks == "own"
        self._sources = sources_of(machine, cycle_hz)
        self._drifts = [Drift(self._rate_hz) for _ in drives[1:]]
        self._leads = machine.leads
        self._alignment = Alignment([self._position(j) for j in range(len(self._drifts))])
        for drive in drives if self._own else ():
            drive.bounds = Bounds(1.0 / self._rate_hz)
        self._forces: dict[int, NDArray] = {}
        self._bucket_ends: float | None = None
        self._last: Row | None = None

    def _position(self, j: int) -> Callable[[int], float | None]:
        """Return where the drive after the first ``j`` is in its own samples at one of the first
        drive's."""
        if not self._own:
            lead = self._leads[j + 1]
            return lambda sequence: float(sequence + lead)
        drift = self._drifts[j]
        return lambda sequence: drift.estimate.position(sequence) if drift.estimate else None

    async def rows(self, row: Row) -> list[Row]:
        """Return rows that are whole now, at the first drive's instants; no sample has gone in that
        was not judged."""
        now = time.monotonic()
        self._bucket_ends = self._bucket_ends or now + BUCKET_S
        pairs = zip(self._sources, row.drives, strict=True)
        samples = await all_answers(source.samples(reading) for source, reading in pairs)
        samples = self._judge(row, samples, now)
        if self._own:
            self._compare(row, now)
        if not np.isnan(row.forces).all():
            self._forces[row.drives[0].sequence] = row.forces
        return list(self._whole(samples))

    def end(self) -> None:
        """Ask the drives for nothing more beside the cycle."""
        for source in self._sources:
            source.pending.end()

    def _whole(self, samples: Sequence[Sequence[Reading]]) -> Iterator[Row]:
        for drives in self._alignment.rows(samples):
            sequence = drives[0].sequence
            forces = self._forces.pop(sequence, self._machine.no_force)
            for missed in [earlier for earlier in self._forces if earlier < sequence]:
                del self._forces[missed]
            self._last = Row(drives, forces, self._machine.samples_per_cycle)
            yield self._last

    def _compare(self, row: Row, now: float) -> None:
        """Compare the clocks from time to time."""
        if self._bucket_ends is None or now < self._bucket_ends:
            return
        self._bucket_ends = now + BUCKET_S
        first, *others = (
            drive.bounds.close() if drive.bounds else None for drive in self._machine.drives
        )
        for drift, other in zip(self._drifts, others, strict=True):
            if first and other:
                drift.add(row.drives[0].sequence, first, other)

    def clocks(self, since_s: float) -> dict[str, dict]:
        """Return offset and rate of each drive's clock against the first one's, by joint.

        The offset is that at ``since_s`` of the first drive's clock.
        """
        clocks: dict[str, dict] = {}
        for j, drift in enumerate(self._drifts, start=1):
            if self._last is None or drift.estimate is None:
                continue
            first, other = self._last.drives[0], self._last.drives[j]
            offset = other.time - first.time - drift.estimate.rate * (first.time - since_s)
            clocks[self._machine.drives[j].settings.joint] = {
                "offset_s": offset,
                "offset_error_s": drift.estimate.lead_error / self._rate_hz,
                "rate_ppm": 1e6 * drift.estimate.rate,
                "rate_error_ppm": 1e6 * drift.estimate.rate_error,
                "corrected": True,
            }
        return clocks


def sources_of(machine: Machine, cycle_hz: float) -> list[Recorded | Cycled]:
    """Return where each drive's samples come from, where they are not kept as the cycle brings
    them; else nothing."""
    if machine.latches:
        return []
    if machine.rig.sampling == "recorder":
        return [Recorded(drive) for drive in machine.drives]
    period = 1.0 / (cycle_hz * machine.samples_per_cycle)
    return [Cycled(drive, period, looks_again=j > 0) for j, drive in enumerate(machine.drives)]


def sampling_of(machine: Machine, cycle_hz: float, judge: Judge) -> Sampling:
    """Return how the samples of a machine are to be had; set-points go out at ``cycle_hz``.

    Raises
    ------
    DeviceError
        Where the lines are too slow to tell which samples belong together.
    """
    if machine.latches:
        return Latched()
    if machine.rig.clocks == "common" and machine.leads_are_vague:
        raise DeviceError(
            "the lines are too slow to tell which samples of the drives' rings belong together;"
            ' raise their speed, or set clocks = "own" in the rig file'
        )
    return Streams(machine, cycle_hz, judge)

"""Where recorded samples come from: the cycle itself, or the drives' own records and clocks."""

import asyncio
import time
from collections.abc import Awaitable, Callable, Iterator, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from pipelines.acquisition.machine.clock_offset import BUCKET_S, Bounds, Drift
from pipelines.acquisition.machine.drive import Drive
from pipelines.acquisition.machine.machine import Machine, all_answers
from pipelines.acquisition.machine.reading import Reading
from pipelines.acquisition.machine.resampling import Alignment
from pipelines.acquisition.machine.row import Row
from pipelines.errors import DeviceError, Unanswered

RecordCheck = Callable[[Row, Sequence[Sequence[Reading]], float], list[list[Reading]]]
"""From a row, each drive's samples and the host's time (s) to new samples; raises DeviceError."""

SECOND_LOOK = (0.3, 0.65)
"""Earliest and latest second reading of a drive with its own clock, in samples: none is missed."""
AIM = 0.1
"""Standard deviation of the second reading's instant about the drive's next sample, in samples."""


class LatchedSampling:
    """Drives latch their samples at one instant: a cycle's row is recorded as it is."""

    async def rows(self, row: Row) -> list[Row]:
        """Return the cycle's row."""
        return [row]

    def end(self) -> None:
        """Do nothing: only the cycle sends requests."""

    def clocks(self, since_s: float) -> dict[str, dict]:
        """Return nothing: there is one clock."""
        return {}


class BackgroundRequest:
    """A request to a drive that the cycle does not wait for; one at a time."""

    def __init__(self) -> None:
        self._request: asyncio.Task[list[Reading] | DeviceError] | None = None

    @property
    def is_under_way(self) -> bool:
        """Whether there is a request whose result was not fetched yet."""
        return self._request is not None

    @property
    def is_answered(self) -> bool:
        """Whether its result can be fetched without waiting."""
        return self._request is not None and self._request.done()

    def begin(self, request: Callable[[], Awaitable[list[Reading]]]) -> None:
        """Begin a request."""
        self._request = asyncio.create_task(self._outcome(request))

    async def result(self) -> list[Reading]:
        """Wait for the samples of the request; none without a request or an answer.

        Raises
        ------
        DeviceError
            The request failed otherwise than by a missing answer.
        """
        if self._request is None:
            return []
        result, self._request = await self._request, None
        if isinstance(result, DeviceError):
            raise result
        return result

    def end(self) -> None:
        """Cancel the request: the drive is to be slowed down."""
        if self._request:
            self._request.cancel()

    async def _outcome(
        self, request: Callable[[], Awaitable[list[Reading]]]
    ) -> list[Reading] | DeviceError:
        try:
            return await request()
        except Unanswered:
            return []
        except DeviceError as error:
            return error


class CycleSource:
    """Samples of one drive from the cycle, and a second reading where it has its own clock."""

    def __init__(self, drive: Drive, period_s: float, *, looks_again: bool) -> None:
        self._drive, self._period_s, self._looks_again = drive, period_s, looks_again
        # Looks at a fixed phase would never narrow the bounds, so they are spread at random.
        self._dither = np.random.default_rng(0)
        self.pending = BackgroundRequest()

    async def samples(self, reading: Reading) -> list[Reading]:
        """Return the second reading of the last cycle, if any, and this cycle's ``reading``."""
        earlier = await self.pending.result()
        if self._looks_again:
            self.pending.begin(self._look_again)
        return [*earlier, reading]

    async def _look_again(self) -> list[Reading]:
        """Read the drive near its next sample: such a reply bounds its clock most narrowly."""
        low, high = (share * self._period_s for share in SECOND_LOOK)
        bounds = self._drive.bounds
        due = bounds.until_next_sample(time.perf_counter()) if bounds else None
        # Until the next sample's instant is known, any phase is as good as another.
        if due is None:
            aim = self._dither.uniform(low, high)
        else:
            aim = due + self._dither.normal(0.0, AIM) * self._period_s
        await asyncio.sleep(float(np.clip(aim, low, high)))
        return [await self._drive.look(in_motion=True)]


class RecorderSource:
    """Samples that one drive recorded itself, drained as soon as they fill a read."""

    def __init__(self, drive: Drive) -> None:
        assert drive.ring  # the rig file is checked: with recorders, every drive has one
        self._drive, self._block = drive, drive.ring.block
        self._drained: int | None = None
        self.pending = BackgroundRequest()

    async def samples(self, reading: Reading) -> list[Reading]:
        """Return the samples drained since the last cycle, often none; begin a drain if due."""
        samples = await self.pending.result() if self.pending.is_answered else []
        is_due = self._drained is None or reading.sequence >= self._drained + self._block
        if is_due and not self.pending.is_under_way:
            self.pending.begin(partial(self._drain, reading.sequence))
            if self._drive.in_lockstep:  # no time passes for the drives meanwhile
                return samples + await self.pending.result()
        return samples

    async def _drain(self, newest: int) -> list[Reading]:
        """Drain the record; samples of a missing answer come with the next drain."""
        samples = await self._drive.drain(newest)
        self._drained = samples[-1].sequence if samples else newest
        return samples


class AlignedSampling:
    """Each drive's samples come separately, and are resampled at the first drive's instants."""

    def __init__(self, machine: Machine, cycle_hz: float, check: RecordCheck) -> None:
        rig, drives = machine.rig, machine.drives
        self._machine, self._check = machine, check
        self._rate_hz = cycle_hz * machine.samples_per_cycle
        self._has_own_clocks = rig.clocks == "own"
        self._sources = sources_of(machine, cycle_hz)
        self._drifts = [Drift(self._rate_hz) for _ in drives[1:]]
        self._leads = machine.leads
        self._alignment = Alignment([self._position(j) for j in range(len(self._drifts))])
        for drive in drives if self._has_own_clocks else ():
            drive.bounds = Bounds(1.0 / self._rate_hz)
        self._forces: dict[int, NDArray] = {}
        self._bucket_ends: float | None = None
        self._last: Row | None = None

    def _position(self, j: int) -> Callable[[int], float | None]:
        """Return the function from a sample of the first drive to that of drive ``j + 1``."""
        if not self._has_own_clocks:
            lead = self._leads[j + 1]
            return lambda sequence: float(sequence + lead)
        drift = self._drifts[j]
        return lambda sequence: drift.estimate.position(sequence) if drift.estimate else None

    async def rows(self, row: Row) -> list[Row]:
        """Return the rows that are complete now, oldest first; every sample was checked."""
        now = time.monotonic()
        self._bucket_ends = self._bucket_ends or now + BUCKET_S
        pairs = zip(self._sources, row.drives, strict=True)
        samples = await all_answers(source.samples(reading) for source, reading in pairs)
        samples = self._check(row, samples, now)
        if self._has_own_clocks:
            self._compare_clocks(row, now)
        if not np.isnan(row.forces).all():
            self._forces[row.drives[0].sequence] = row.forces
        return list(self._complete_rows(samples))

    def end(self) -> None:
        """Cancel all requests to the drives but those of the cycle."""
        for source in self._sources:
            source.pending.end()

    def _complete_rows(self, samples: Sequence[Sequence[Reading]]) -> Iterator[Row]:
        for drives in self._alignment.rows(samples):
            sequence = drives[0].sequence
            forces = self._forces.pop(sequence, self._machine.no_force)
            # A row that was left out never asks for its forces.
            for missed in [earlier for earlier in self._forces if earlier < sequence]:
                del self._forces[missed]
            self._last = Row(drives, forces, self._machine.samples_per_cycle)
            yield self._last

    def _compare_clocks(self, row: Row, now: float) -> None:
        """Update the drifts at the end of each bucket of time."""
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
        """Return offset and rate of each drive's clock against the first one's.

        Parameters
        ----------
        since_s : float
            First drive's clock, at which offsets are given, s.

        Returns
        -------
        dict
            By joint: offsets in s, rates in ppm.
        """
        clocks: dict[str, dict] = {}
        for j, drift in enumerate(self._drifts, start=1):
            if self._last is None or drift.estimate is None:
                continue
            first, other = self._last.drives[0], self._last.drives[j]
            # Both times are of one instant, as the other drive was resampled. The rate leads back
            # to `since_s`.
            offset = other.time - first.time - drift.estimate.rate * (first.time - since_s)
            clocks[self._machine.drives[j].settings.joint] = {
                "offset_s": offset,
                "offset_error_s": drift.estimate.lead_error / self._rate_hz,
                "rate_ppm": 1e6 * drift.estimate.rate,
                "rate_error_ppm": 1e6 * drift.estimate.rate_error,
                "corrected": True,
            }
        return clocks


Sampling = LatchedSampling | AlignedSampling
"""Decides which rows are recorded."""


def sources_of(machine: Machine, cycle_hz: float) -> list[RecorderSource | CycleSource]:
    """Return the source of each drive's samples; none where a cycle's row is recorded as it is."""
    if machine.latches:
        return []
    if machine.rig.sampling == "recorder":
        return [RecorderSource(drive) for drive in machine.drives]
    period = 1.0 / (cycle_hz * machine.samples_per_cycle)
    # Cycles keep in step with the first drive's counter, so it needs no second reading.
    return [CycleSource(drive, period, looks_again=j > 0) for j, drive in enumerate(machine.drives)]


def sampling_of(machine: Machine, cycle_hz: float, check: RecordCheck) -> Sampling:
    """Return the sampling of a machine whose set-points are sent at ``cycle_hz``.

    Raises
    ------
    DeviceError
        The lines are too slow to know which samples belong together.
    """
    if machine.latches:
        return LatchedSampling()
    if machine.rig.clocks == "common" and machine.leads_are_vague:
        raise DeviceError(
            "the lines are too slow to match the samples of the drives' records; raise their"
            ' speed, or set clocks = "own" in the rig file'
        )
    return AlignedSampling(machine, cycle_hz, check)

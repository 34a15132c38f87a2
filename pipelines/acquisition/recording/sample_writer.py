"""The writer of a run's samples to its journal, which notes missing ones."""

from pipelines.acquisition.machine.machine import Machine
from pipelines.acquisition.machine.row import Row
from pipelines.acquisition.recording.columns import columns_of
from pipelines.acquisition.recording.journal import Journal
from pipelines.errors import DeviceError


class SampleWriter:
    """The journal of one run, filled sample by sample."""

    def __init__(self, journal: Journal, machine: Machine, samples: int, rate_hz: float) -> None:
        """Write so many samples of a machine's drives at a rate."""
        self._journal, self._samples, self._rate_hz = journal, samples, rate_hz
        self._columns = columns_of(machine)
        self.gaps: list[tuple[float, int]] = []
        """First missing time and number of missing samples, within the recording."""
        self.began_at: float | None = None
        """When the recording began, the machine's clock, s."""
        self._next = 0

    @property
    def rows(self) -> int:
        """Samples that were written."""
        return self._journal.rows

    def write(self, row: Row, sample: int) -> None:
        """Write a sample of the recording by its number, and note those missed before it.

        Raises
        ------
        DeviceError
            The journal cannot be written.
        """
        missing = range(self._next, min(sample, self._samples))
        if missing:
            self.gaps.append((missing.start / self._rate_hz, len(missing)))
        # Samples of the ramp have negative numbers, and are not missed.
        self._next = max(sample + 1, 0)
        if not 0 <= sample < self._samples:
            return
        if self.began_at is None:
            # Where the trajectory begins, even if the first samples are missing.
            self.began_at = row.time - sample / self._rate_hz
        values = [value(row) for value in self._columns.values()]
        try:
            self._journal.append([row.time - self.began_at, *values])
        except OSError as error:
            raise DeviceError(f"the journal cannot be written ({error})") from error

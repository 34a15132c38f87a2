"""Whether a drive's clock goes on in step with its sample counter, at the rate of the run."""

from pipelines.acquisition.machine.reading import Reading
from pipelines.acquisition.modbus.wraparound import RATE_TOLERANCE, keeps_time


class ClockCheck:
    """The clock of one drive since its first sample."""

    def __init__(self, label: str, samples_per_cycle: int, rate_hz: float) -> None:
        """Check a drive with a label, which takes samples at a rate."""
        # Cycles after which a clock's rate is checked; by then a step differs from a wrong unit.
        settled_cycles = 50
        self._label, self._rate = label, rate_hz
        self._fewest = settled_cycles * samples_per_cycle
        self._first: Reading | None = None

    def begin(self, reading: Reading) -> None:
        """Begin with a sample."""
        self._first = reading

    def check_rate(self, before: Reading, reading: Reading) -> str | None:
        """Return the fault where the clock does not go on, or not at the rate of the run."""
        if reading is not before and not reading.time > before.time:
            return (
                f"{self._label}: its clock went from {before.time:.6f} to {reading.time:.6f} s"
                f" while its counter went from {before.sequence} to {reading.sequence}; was it"
                " restarted?"
            )
        first = self._first
        if first is None or not self._is_settled(reading):
            return None
        samples = reading.sequence - first.sequence
        rate = samples / max(reading.time - first.time, 1e-9)
        if abs(rate / self._rate - 1.0) <= RATE_TOLERANCE:
            return None
        return (
            f"{self._label}: samples {rate:.4g} times a second by its own clock, expected"
            f" {self._rate:g}; correct acquire.sample_rate_hz, or the unit of time in the rig file"
        )

    def check_step(self, before: Reading, reading: Reading) -> str | None:
        """Return the fault where clock and counter differ from one sample to the next."""
        samples, seconds = reading.sequence - before.sequence, reading.time - before.time
        if not self._is_settled(reading) or keeps_time(samples, seconds, self._rate):
            return None
        return (
            f"{self._label}: its clock went on by {seconds:.6f} s while its counter went on by"
            f" {samples} samples of {1 / self._rate:.6f} s; one of the two leapt: was it restarted,"
            " or is its answer damaged?"
        )

    def _is_settled(self, reading: Reading) -> bool:
        """Return whether enough samples have come to measure the rate."""
        return self._first is not None and reading.sequence - self._first.sequence >= self._fewest

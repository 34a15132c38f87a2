"""How far a run is, as an operator's view shows it."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from pipelines.acquisition.machine.row import Row
from pipelines.acquisition.plan import Plan
from pipelines.acquisition.recording.sample_writer import SampleWriter
from pipelines.acquisition.safety.supervisor import Supervisor
from pipelines.acquisition.states import State


@dataclass(frozen=True)
class Progress:
    """State, time, sample and reason to stop, for the operator."""

    state: State = State.IDLE
    time_s: float = 0.0
    """Since the recording began; negative on the way there."""
    duration_s: float = 0.0
    row: Row | None = None
    samples: int = 0
    missed: int = 0
    gaps: int = 0
    """In how many places samples were missed."""
    rate_hz: float = 0.0
    """Samples a second of wall time."""
    abort: str | None = None
    """Why the run is being stopped early."""
    still_enabled: bool = False
    """Whether a drive may still move the leg though it was sent to disable."""


Report = Callable[[Progress], None]


class ProgressReport:
    """Reports the progress of one run."""

    def __init__(
        self, supervisor: Supervisor, plan: Plan, writer: SampleWriter, report: Report
    ) -> None:
        """Report the state of a run's supervisor and writer to ``report``."""
        self._supervisor, self._plan = supervisor, plan
        self._writer, self._report = writer, report
        self._began_at = self._reported_at = 0.0

    def begin(self, now: float) -> None:
        """Begin when the drives are enabled, host's clock, s."""
        self._began_at = self._reported_at = now

    def report_seldom(self, row: Row) -> None:
        """Report, unless the last report was a moment ago."""
        # Time between two reports.
        report_s = 0.1
        if time.monotonic() - self._reported_at >= report_s:
            self.report(row)

    def report(self, row: Row | None) -> None:
        """Report how far the run is with its last sample."""
        self._reported_at = time.monotonic()
        supervisor, plan = self._supervisor, self._plan
        progress = Progress(
            supervisor.state,
            duration_s=(plan.stop - plan.first) / supervisor.rate,
            abort=supervisor.why,
            still_enabled=supervisor.still_enabled,
        )
        if row is not None:
            set_point = supervisor.progress.set_point(row)
            # All samples since the drives were enabled: those of the first two cycles carry no
            # set-point.
            samples = (set_point + 2) * row.samples_per_cycle
            gaps = self._writer.gaps
            progress = replace(
                progress,
                time_s=(set_point - plan.first) / supervisor.rate,
                row=row,
                samples=self._writer.rows,
                missed=sum(count for _, count in gaps),
                gaps=len(gaps),
                rate_hz=samples / (self._reported_at - self._began_at),
            )
        self._report(progress)

"""All checks of the samples of one cycle, behind one method."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipelines.acquisition.machine.reading import Reading
from pipelines.acquisition.machine.row import Answers, Row
from pipelines.acquisition.safety.cuff_checks import CuffChecks
from pipelines.acquisition.safety.limits import Limits
from pipelines.acquisition.safety.record_agreement import RecordAgreement
from pipelines.acquisition.safety.sample_stream import SampleStream
from pipelines.acquisition.safety.set_point_history import SetPointHistory
from pipelines.acquisition.safety.set_point_tracker import SetPointTracker
from pipelines.acquisition.safety.stuck_register import ANSWER_CYCLES
from pipelines.errors import DeviceError, Unanswered
from pipelines.mechanics.motion import CUFFS
from pipelines.settings.rig import RigSettings
from pipelines.settings.rig.devices import SensorSettings


class SampleChecks:
    """Checks samples against limits, set-points, one another and the drives' own records.

    Every method raises DeviceError where a sample is reason to stop.
    """

    def __init__(
        self, rig: RigSettings, sample_rate_hz: float, sensors: Sequence[SensorSettings]
    ) -> None:
        """Check the drives of a rig, and those cuff sensors that are read."""
        self._samples_per_cycle = rig.samples_per_cycle(sample_rate_hz)
        self._limits = Limits(rig, sample_rate_hz, sensors)
        self._cuffs = CuffChecks(sample_rate_hz)
        self._histories = [SetPointHistory() for _ in rig.drive]
        self.streams = [
            SampleStream(rig, joint, sample_rate_hz, history)
            for joint, history in enumerate(self._histories)
        ]
        """The answers to exchanges, by joint."""
        # Streams of their own: records come later than the exchanges, and would seem to go back.
        self._records = [
            SampleStream(rig, joint, sample_rate_hz, history)
            for joint, history in enumerate(self._histories)
        ]
        recorded_hz = sample_rate_hz * self._samples_per_cycle
        self._agreements = [
            RecordAgreement(rig, joint, recorded_hz) for joint in range(len(rig.drive))
        ]

    def begin(self, row: Row, trackers: Sequence[SetPointTracker], now: float) -> None:
        """Begin with the first sample of enabled drives."""
        for joint, reading in enumerate(row.drives):
            self.streams[joint].begin(reading, now)
            self._note_sent(joint, reading, trackers[joint])

    def _note_sent(self, joint: int, reading: Reading, tracker: SetPointTracker) -> None:
        """Note that a set-point was sent while a sample was the newest."""
        self._histories[joint].add(reading.sequence, tracker.sent)

    def refuse_silence(self, cycle: int, now: float) -> None:
        """Refuse too long a silence, and a counter that runs backwards or leaps."""
        for stream in self.streams:
            stream.refuse_silence(now)
        self.streams[0].refuse_count((cycle + 1) * self._samples_per_cycle - 1)

    def leave_out(self, trackers: Sequence[SetPointTracker], since: int, until: int) -> None:
        """Note that the drives were sent nothing between two cycles."""
        for stream, record, tracker in zip(self.streams, self._records, trackers, strict=True):
            first, last = (
                cycle * self._samples_per_cycle + int(tracker.counter_lead)
                for cycle in (since, until)
            )
            stream.leave_out(first, last)
            record.leave_out(first, last)

    def check_limits(self, samples: Row | Answers) -> None:
        """Refuse samples that break a limit."""
        reason = self._limits.violation(samples)
        if reason:
            raise DeviceError(reason)

    def check_at(self, answers: Answers, set_points: Sequence[float]) -> None:
        """Refuse answers that break a limit, or are too far from set-points, (J,) rad."""
        reason = self._limits.violation(answers) or self._limits.straying(answers, set_points)
        if reason:
            raise DeviceError(reason)

    def check_held(self, joint: int, reading: Reading, trackers: Sequence[SetPointTracker]) -> None:
        """Refuse an answer of a drive that is held while others are awaited, as for any other."""
        silent = Unanswered("others are awaited")
        of_drives = tuple(reading if j == joint else silent for j in range(len(trackers)))
        answers = Answers(of_drives, np.full((len(CUFFS), 3), np.nan), None)
        base = [tracker.base for tracker in trackers]
        # The sample was latched before the set-point that was sent with the question takes effect.
        reason = (
            self.streams[joint].limit_violation(reading)
            or self._limits.cuff_violation(answers)
            or self._limits.straying(answers, base, late=1)
        )
        if reason:
            raise DeviceError(self._with_jerk(reason))
        self._note_sent(joint, reading, trackers[joint])

    def check(
        self, answers: Answers, trackers: Sequence[SetPointTracker], cycle: int, now: float
    ) -> Row | None:
        """Return a cycle's sample where it is whole and new; refuse answers that stop a run."""
        is_new = [
            self._is_new(joint, answer, trackers[joint], cycle, now)
            for joint, answer in enumerate(answers.drives)
        ]
        reason = self._limits.cuff_violation(answers) or self._straying(answers, trackers, cycle)
        if reason:
            raise DeviceError(self._with_jerk(reason))
        row = answers.row
        if row is None or not is_new[0]:  # the first drive's counter is the machine's
            return None
        reason = self._cuffs.implausible(row.forces, row.sequence, self._sent_travel(row))
        if reason:
            raise DeviceError(reason)
        return row

    def check_records(
        self, row: Row, records: Sequence[Sequence[Reading]], now: float
    ) -> list[list[Reading]]:
        """Check the drives' own records next to the sample of a cycle; return their new samples."""
        new = []
        of_drives = zip(self._records, self._agreements, row.drives, records, strict=True)
        for stream, agreement, newest, samples in of_drives:
            agreement.add(newest)
            new.append([reading for reading in samples if stream.check(reading, now)])
            for reading in new[-1]:
                agreement.check(reading)
            stream.refuse_to_fall_behind(newest.sequence)
        return new

    def presses(self, forces: NDArray) -> bool:
        """Return whether a cuff force of (4, 3) N is above its limit."""
        return self._limits.force_violation(forces) is not None

    def _is_new(
        self,
        joint: int,
        answer: Reading | Unanswered,
        tracker: SetPointTracker,
        cycle: int,
        now: float,
    ) -> bool:
        """Return whether an answer is a new sample."""
        stream = self.streams[joint]
        if isinstance(answer, Unanswered):
            stream.miss(answer)
            is_new = False
        else:
            is_new = stream.check(answer, now)
            if is_new:
                tracker.meet(answer, cycle)
            # The set-point sent with the question takes effect after the sample of the answer.
            self._note_sent(joint, answer, tracker)
        stream.refuse_silence(now)
        return is_new

    def _straying(
        self, answers: Answers, trackers: Sequence[SetPointTracker], cycle: int
    ) -> str | None:
        """Return which joint is too far from its set-point."""
        first = answers.drives[0]
        # Without the machine's counter as for a drive that is held.
        late = 1
        if not isinstance(first, Unanswered):
            late = abs(first.sequence // self._samples_per_cycle - cycle)
        return self._limits.straying(answers, [tracker.in_force for tracker in trackers], late)

    def _with_jerk(self, reason: str) -> str:
        """Return a reason with a possible jerk of any joint: one drive moves the whole leg."""
        extended = (stream.after_jerk(reason) for stream in self.streams)
        return next((text for text in extended if text != reason), reason)

    def _sent_travel(self, row: Row) -> float:
        """Return how far all joints together were sent up to a sample, rad."""
        lag = ANSWER_CYCLES * row.samples_per_cycle
        pairs = zip(self._histories, row.drives, strict=True)
        return sum(history.at(reading.sequence - lag).travel for history, reading in pairs)

"""From rest to enabled drives: the leg must stand where the plan begins until all have enabled."""

from collections.abc import Sequence
from math import inf

from pipelines.acquisition.machine.row import Answers, Row
from pipelines.acquisition.safety.enable_state import EnableStates
from pipelines.acquisition.safety.sample_checks import SampleChecks
from pipelines.acquisition.safety.set_point_tracker import SetPointTracker
from pipelines.acquisition.safety.stop_reason import StopReason
from pipelines.errors import DeviceError, Unanswered
from pipelines.settings.rig import RigSettings

REST_RAD = 0.02
"""How far the leg may move from the plan's start until the drives are enabled, rad."""


class Enabling:
    """Enables the drives of a rig where the leg stands."""

    def __init__(
        self,
        rig: RigSettings,
        sample_rate_hz: float,
        trackers: Sequence[SetPointTracker],
        enable_states: EnableStates,
        checks: SampleChecks,
        reason: StopReason,
    ) -> None:
        """Enable the drives that are tracked, unless there is a reason to stop."""
        self._rig, self._rate = rig, sample_rate_hz
        self._trackers, self._enable_states, self._checks = trackers, enable_states, checks
        self._reason = reason
        self._start: list[float] = []
        """Where the leg stood when the plan was made, (J,) rad."""
        self._silent_from_s: list[float] = []
        """Since when each drive has not answered, s after the start of enabling."""

    def start_at(self, angles: Sequence[float]) -> None:
        """Enable the drives where the leg stands.

        Parameters
        ----------
        angles : (J,) sequence of float
            rad.
        """
        self._start, self._silent_from_s = list(angles), [inf] * len(angles)
        for tracker, angle in zip(self._trackers, angles, strict=True):
            tracker.start_at(angle)

    def check_at_rest(self, row: Row) -> None:
        """Refuse to enable drives whose leg has moved from the plan's start, or breaks a limit.

        Raises
        ------
        DeviceError
            Either is so, or a drive reports a fault.
        """
        for tracker, angle in zip(self._trackers, row.angle, strict=True):
            drive, planned = tracker.drive, tracker.sent
            # The drive goes from where the leg stands to its first set-point within one sample.
            if not abs(angle - planned) <= min(REST_RAD, drive.speed_rad_s / self._rate):
                raise DeviceError(
                    f"the {drive.joint} moved from {planned:.3f} to {angle:.3f} rad before its"
                    " drive was enabled; keep the leg still and start again"
                )
        self._enable_states.update_all(row)
        self._checks.check_limits(row)

    def set_point(self, joint: int, now: float) -> float:
        """Return the set-point (rad) with which a drive is enabled: where the leg stands.

        Raises
        ------
        DeviceError
            The run is being stopped.
        """
        self._reason.refuse()
        return self._trackers[joint].follow(self._start[joint], 0.0, now)

    def check(self, answers: Answers, waited_s: float) -> Row | None:
        """Return the sample at which every drive reports that it is enabled; None until then.

        Raises
        ------
        Unanswered
            A drive has not answered for longer than the watchdog waits.
        DeviceError
            A drive is not enabled after ``safety.control_s``, or a limit is broken.
        """
        self._enable_states.update_all(answers)
        # Within the watchdog's time a lost reply is no reason to stop, as the leg is at rest.
        for j, answer in enumerate(answers.drives):
            if not isinstance(answer, Unanswered):
                self._silent_from_s[j] = inf
                continue
            self._silent_from_s[j] = min(self._silent_from_s[j], waited_s)
            if waited_s - self._silent_from_s[j] > self._rig.safety.watchdog_s:
                raise answer
        idle = self._enable_states.idle
        if idle and waited_s > self._rig.safety.control_s:
            raise DeviceError(
                f"drive {idle[0]}: not enabled {self._rig.safety.control_s:g} s after the command,"
                " by its status word; see the drive's manual, correct"
                " enabled_mask and enabled_value in the rig file, or raise safety.control_s there"
            )
        self._checks.check_at(answers, self._start)
        return None if idle else answers.row

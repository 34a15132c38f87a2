"""The safe stop: every drive slows down, is held at rest for a moment, and is then disabled."""

from collections.abc import Sequence

from numpy.typing import NDArray

from pipelines.acquisition.machine.reading import Reading
from pipelines.acquisition.safety.enable_state import EnableStates
from pipelines.acquisition.safety.limits import HOLD_SAMPLES, allowed_error_rad
from pipelines.acquisition.safety.sample_checks import SampleChecks
from pipelines.acquisition.safety.set_point_tracker import SetPointTracker
from pipelines.settings.rig.safety import SafetySettings


class SafeStop:
    """Slows the drives down, each by itself, unless that would go on pressing."""

    def __init__(
        self,
        safety: SafetySettings,
        sample_rate_hz: float,
        trackers: Sequence[SetPointTracker],
        enable_states: EnableStates,
        checks: SampleChecks,
    ) -> None:
        self._safety, self._rate = safety, sample_rate_hz
        self._trackers, self._enable_states, self._checks = trackers, enable_states, checks
        self.pressing = False
        """Whether slowing down would go on pressing: the drives are then disabled without it."""
        self._samples_at_rest = [0 for _ in trackers]
        """For how many samples each drive has been held at rest."""

    def set_point(self, joint: int, now: float) -> tuple[float, bool] | None:
        """Return the set-point that slows one drive down, one a sample.

        There is none as soon as the drive has been held for long enough, as holding on would go on
        pressing, or as it must not be sent to enable.

        Parameters
        ----------
        joint : int
            Number of the joint.
        now : float
            Host's clock, s.

        Returns
        -------
        tuple or None
            Set-point, rad, and whether the drive is to halt there.
        """
        is_held = self._samples_at_rest[joint] >= HOLD_SAMPLES
        if is_held or self.pressing or not self._enable_states[joint].may_be_sent:
            return None
        base = self._trackers[joint].base
        reference = self._trackers[joint].slow_down(now)
        # At rest, the set-point no longer changes.
        halt = reference == base
        self._samples_at_rest[joint] += halt
        return reference, halt

    def check(self, joint: int, reading: Reading, late: int = 0) -> None:
        """Check the answer of a drive whose set-point is some samples ``late``.

        Raises
        ------
        DeviceError
            The drive has a fault or is no longer enabled.
        """
        tracker = self._trackers[joint]
        error = reading.angle - tracker.base
        allowed = allowed_error_rad(self._safety, tracker.drive, late / self._rate)
        # Latched: a leg that was let go of must not be held again.
        self.pressing |= not abs(reading.torque) <= tracker.drive.torque_nm
        self.pressing |= not abs(error) <= allowed
        self._enable_states.update(joint, reading)

    def check_cuffs(self, forces: NDArray) -> None:
        """Check the cuff forces.

        Parameters
        ----------
        forces : (4, 3) array
            N.
        """
        self.pressing |= self._checks.presses(forces)

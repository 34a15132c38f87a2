"""Whether the drives are enabled, by each drive's own report."""

from collections.abc import Iterable, Sequence

from pipelines.acquisition.machine.reading import DriveStatus, Reading
from pipelines.acquisition.machine.row import Answers, Row
from pipelines.errors import DeviceError
from pipelines.settings.rig.devices import DriveSettings


class EnableState:
    """The last report of one drive on whether it is enabled."""

    def __init__(self, joint: str) -> None:
        self.joint = joint
        self.enabled: bool | None = None
        """The last report; None while the drive has made none."""
        self._has_dropped = False

    @property
    def may_be_sent(self) -> bool:
        """Whether the drive may still be sent set-points in a stop.

        A drive that reported a fault, or that it is no longer enabled, must not be sent to enable
        with its leg anywhere.
        """
        return not self._has_dropped and self.enabled is not False

    def update(self, status: DriveStatus) -> str | None:
        """Note a report; return the reason to stop where the drive has a fault or dropped out.

        A drive with a fault counts as not enabled: it may be again as soon as the fault is cleared.

        Parameters
        ----------
        status : DriveStatus
            The drive's report.

        Returns
        -------
        str or None
            None where there is no reason to stop.
        """
        dropped = bool(self.enabled) and status.enabled is False
        if status.enabled is not None:
            self.enabled = status.enabled
        self._has_dropped |= dropped or status.fault is not None
        if status.fault or not dropped:
            return status.fault
        return (
            f"drive {self.joint}: its status word says that it is no longer enabled; was the"
            " emergency stop pressed?"
        )


class EnableStates:
    """The enable states of all drives; a fault, or a drive that dropped out, ends the run."""

    def __init__(self, drives: Sequence[DriveSettings]) -> None:
        self._states = [EnableState(drive.joint) for drive in drives]

    def __getitem__(self, joint: int) -> EnableState:
        return self._states[joint]

    @property
    def idle(self) -> list[str]:
        """Joints whose drives report that they are not enabled."""
        return [state.joint for state in self._states if state.enabled is False]

    def update(self, joint: int, status: DriveStatus) -> None:
        """Note one drive's report.

        Parameters
        ----------
        joint : int
            Number of the joint.
        status : DriveStatus
            The drive's report.

        Raises
        ------
        DeviceError
            The report is a reason to stop.
        """
        self._update([(joint, status)])

    def update_all(self, samples: Row | Answers) -> None:
        """Note the reports of samples.

        Parameters
        ----------
        samples : Row or Answers
            One sample of each drive, as far as they answered.

        Raises
        ------
        DeviceError
            A report is a reason to stop.
        """
        answers = enumerate(samples.drives)
        self._update((joint, one) for joint, one in answers if isinstance(one, Reading))

    def update_records(self, records: Sequence[Sequence[Reading]]) -> None:
        """Note the reports of records.

        Parameters
        ----------
        records : sequence of sequences of Reading
            Samples of each drive.

        Raises
        ------
        DeviceError
            A report is a reason to stop.
        """
        self._update((joint, one) for joint, samples in enumerate(records) for one in samples)

    def _update(self, reports: Iterable[tuple[int, DriveStatus]]) -> None:
        """Note every report, then raise the first reason to stop that there is."""
        # All are noted first: the stop must know every drive that has dropped out.
        reasons = [self._states[joint].update(status) for joint, status in reports]
        for reason in filter(None, reasons):
            raise DeviceError(reason)

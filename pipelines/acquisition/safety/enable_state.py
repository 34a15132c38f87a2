"""Whether a drive is enabled, by what it reports itself."""

from collections.abc import Sequence

from pipelines.acquisition.machine.reading import DriveStatus, Reading
from pipelines.acquisition.machine.row import Answers, Row
from pipelines.errors import DeviceError


class EnableState:
    """What one drive reported of being enabled."""

    def __init__(self, joint: str) -> None:
        """Watch the drive of a joint."""
        self._joint = joint
        self.enabled: bool | None = None
        """The last report; None while the drive has made none."""
        self._has_dropped = False

    @property
    def may_be_sent(self) -> bool:
        """Whether the drive may still be sent set-points in a stop.

        A drive that reported a fault, or that it is no longer enabled, must not be told to enable
        with its leg anywhere.
        """
        return not self._has_dropped and self.enabled is not False

    def update(self, status: DriveStatus) -> str | None:
        """Note a report; return the reason to stop where the drive has a fault or dropped out.

        A drive with a fault counts as not enabled: it may be again as soon as the fault is cleared.
        """
        dropped = bool(self.enabled) and status.enabled is False
        if status.enabled is not None:
            self.enabled = status.enabled
        self._has_dropped |= dropped or status.fault is not None
        if status.fault or not dropped:
            return status.fault
        return (
            f"drive {self._joint}: its status word says that it is no longer enabled; was the"
            " emergency stop pressed?"
        )


def update_all(states: Sequence[EnableState], samples: Row | Answers) -> None:
    """Note every drive's report; refuse to go on where one has a fault or dropped out."""
    pairs = zip(states, samples.drives, strict=True)
    refuse_any([state.update(one) for state, one in pairs if isinstance(one, Reading)])


def refuse_any(reasons: Sequence[str | None]) -> None:
    """Raise DeviceError with the first reason that there is."""
    for reason in filter(None, reasons):
        raise DeviceError(reason)

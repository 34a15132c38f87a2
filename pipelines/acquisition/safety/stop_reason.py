"""Why a run is stopped: the first reason, and the faults after it."""

from asyncio import CancelledError
from collections.abc import Sequence

from pipelines.errors import DeviceError


class StopReason:
    """The reasons to stop one run."""

    def __init__(self) -> None:
        self.text: str | None = None
        """The first reason to stop early; None while there is none."""
        self.further: list[str] = []
        """Later reasons, in their order."""
        self.fault: BaseException | None = None
        """The first error that was exoid's own."""

    def add(self, error: BaseException, *, is_reported: bool) -> None:
        """Add a reason; the first one is kept, and one that ``is_reported`` already is extended."""
        # Any other error is a fault of exoid's own, whose traceback is reported.
        ours = not isinstance(error, DeviceError | KeyboardInterrupt | SystemExit | CancelledError)
        if ours and self.fault is None:
            self.fault = error
        reason = _in_words(error)
        if self.text is None:
            self.text = reason
        elif reason not in (self.text, *self.further):
            self.further.append(reason)
            # `join` has run by then, so the text is extended here.
            if is_reported:
                self.text = f"{self.text}; then {reason}"

    def refuse(self) -> None:
        """Refuse to go on where there is a reason to stop.

        Raises
        ------
        DeviceError
            The first reason.
        """
        if self.text is not None:
            raise DeviceError(self.text)

    def join(self, complaints: Sequence[str]) -> None:
        """Join all reasons, with ``complaints`` of drives that could not be disabled."""
        if self.text is not None:
            self.text = "; then ".join((self.text, *self.further))
        if complaints:
            self.text = (
                f"{self.text or 'the run is complete'}; and could not be disabled:"
                f" {'; '.join(complaints)}"
            )


def _in_words(error: BaseException) -> str:
    """Return an error as a reason to stop."""
    if isinstance(error, DeviceError):
        return str(error)
    if isinstance(error, KeyboardInterrupt):
        return "stopped by Ctrl-C"
    if isinstance(error, SystemExit | CancelledError):
        return "stopped by the program that called exoid"
    return f"a fault of exoid's own ({error!r})"

"""How long it is borne that somebody says nothing."""


class Patience:
    """The time since somebody was heard last; instants ``now`` are the host's, s."""

    def __init__(self, longest_s: float) -> None:
        self.longest_s = longest_s
        self._heard: float | None = None

    def hear(self, now: float) -> None:
        """Note that there was something to hear."""
        self._heard = now

    def waited(self, now: float) -> float:
        """Return for how long nothing was heard, s; the first question begins the wait."""
        if self._heard is None:
            self._heard = now
        return now - self._heard

    def is_over(self, now: float) -> bool:
        """Tell whether that is too long."""
        return self.waited(now) > self.longest_s

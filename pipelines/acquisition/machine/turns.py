"""Angles that start again after a turn: followed from reading to reading, or found out."""

from math import pi

from pipelines.acquisition.modbus.wraparound import unwrap


class FollowedAngle:
    """An angle whose register starts again at 0, as it goes on from turn to turn."""

    def __init__(self, turn: float) -> None:
        """Follow an angle that starts again after ``turn`` (rad)."""
        self._turn = turn
        self._last: tuple[float, float] | None = None
        self._speed = 0.0

    def take(self, angle: float, seconds: float) -> float | None:
        """Return the angle with its turns; None where it is not clear in which turn it is.

        Parameters
        ----------
        angle : float
            As the register shows it, rad.
        seconds : float
            When it was read.
        """
        # Beyond a quarter of a turn from where it was expected, one turn is hardly likelier than
        # the next.
        clear = 0.25
        if self._last is None:
            self._last = seconds, angle
            return angle
        at, before = self._last
        expected = before + self._speed * (seconds - at)
        followed = unwrap(angle, expected, self._turn)
        if abs(followed - expected) > clear * self._turn:
            return None
        if seconds > at:
            self._speed = (followed - before) / (seconds - at)
        self._last = seconds, followed
        return followed


class LastingLeap:
    """Finds an angle that starts again, though the rig file does not say so.

    An angle that leaps by over half a turn from one row to the next, and then goes on from there,
    has started again. One that leaps back is a faulty answer.
    """

    def __init__(self) -> None:
        self._rows: list[tuple[int, float]] = []

    def take(self, number: int, angle: float) -> float | None:
        """Return a leap that has lasted, rad; None where there is none.

        Parameters
        ----------
        number : int
            Of the row; some may be missing.
        angle : float
            Rad.
        """
        self._rows = [*self._rows, (number, angle)][-4:]
        if len(self._rows) < 4:
            return None
        (a, before), (b, last), (c, first), (d, then) = self._rows
        # What the motion explains of the leap, by the faster of the speeds around it.
        moved = (c - b) * max(abs(last - before) / (b - a), abs(then - first) / (d - c))
        leap = first - last
        return leap if abs(leap) - moved > pi and abs(then - first) <= pi else None

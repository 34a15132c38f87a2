"""What the operator of a rig sees while a leg moves: the leg, how near all is to its limits, and
what is wrong."""

import time
from collections.abc import Callable, Iterator
from textwrap import wrap
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray
from rich.console import Console, ConsoleOptions, RenderResult
from rich.segment import Segment
from rich.style import Style

from exoid_cli.big_word import HEIGHT, big
from exoid_cli.canvas import Canvas

if TYPE_CHECKING:
    from pipelines.acquisition.progress import Progress
    from pipelines.settings.rig import RigSettings

CUFFS = ("thigh front", "thigh back", "shank front", "shank back")
NEAR = 0.05
"""Share of the range between two limits within which one of them is near."""
LATELY_S = 3.0
"""For so long a word stands after what it tells of is over: less would be missed."""
BAR = 13
PANEL = 50
"""Columns of the numbers beside the leg."""
BELT = np.array([6.0, 0.0])
"""Dots from the hip to either end of the level line that it hangs from."""
SMALLEST_LEG = 20
"""Columns below which the leg is left out."""
ABOVE, BELOW = 2, 4
"""Rows over and under the leg: the head, and why the run is stopped."""

# Blue and orange are told apart by everyone, and nothing is told by a colour alone.
PLAIN, CALM, URGENT, FAINT = (
    Style(),
    Style(color="bright_blue"),
    Style(color="dark_orange", bold=True),
    Style(dim=True),
)
SHOUT = URGENT + Style(reverse=True)

Line = list[tuple[str, Style]]


class Gauge(NamedTuple):
    """A measured value between its limits."""

    name: str
    value: float
    low: float
    high: float
    unit: str

    @property
    def share(self) -> float:
        """Where it is between its limits, 0 to 1 within them."""
        return (self.value - self.low) / (self.high - self.low)

    @property
    def near(self) -> bool:
        """Whether a limit is near, or passed."""
        return not NEAR <= self.share <= 1.0 - NEAR

    def line(self) -> Line:
        """Draw it: what is near a limit has an exclamation mark beside its bar."""
        if np.isnan(self.value):
            return [(f"{self.name:<11}   not read", FAINT)]
        place = round(min(max(self.share, 0.0), 1.0) * (BAR - 1))
        style = URGENT if self.near else CALM
        value = f"{self.value:+.2f} {self.unit}"
        return [
            (f"{self.name:<11}", PLAIN),
            (f"{value:>12}{'!' if self.near else ' '}", style),
            (f"{self.low:>6g} ", FAINT),
            ("─" * place, FAINT),
            ("█", style),
            ("─" * (BAR - 1 - place), FAINT),
            (f" {self.high:<5g}", FAINT),
        ]


class OperatorView:
    """The picture of a run. It is drawn by whoever renders it, from the progress that was taken
    last.

    Taking progress draws nothing and waits for nobody: a terminal that is slow, or stopped by
    Ctrl-S, must not keep the leg waiting.
    """

    def __init__(self, rig: "RigSettings", run: str) -> None:
        self._rig = rig
        self._run = run
        self._progress: Progress | None = None
        self._forces = np.full((4, 3), np.nan)
        self._lost_at = self._near_at = float("-inf")
        limits = [np.linspace(*drive.angle_rad, 9) for drive in rig.drive[:2]]
        reached = np.concatenate([leg(hip, knee) for hip in limits[0] for knee in limits[1]])
        self._corners = reached.min(axis=0), np.maximum(reached.max(axis=0), 0.1)
        """Of all places that the limits let the leg reach, in thigh lengths from the hip."""

    def take(self, progress: "Progress") -> None:
        """Take the progress that is to be shown."""
        if progress.row is not None:
            # A sensor that is read each second cycle keeps what it told last.
            self._forces = np.where(
                np.isnan(progress.row.forces), self._forces, progress.row.forces
            )
        if self._progress is not None and progress.missed > self._progress.missed:
            self._lost_at = time.monotonic()
        self._progress = progress
        if any(gauge.near for gauge in self.gauges() if not np.isnan(gauge.value)):
            self._near_at = time.monotonic()

    def word(self) -> str:
        """Return the word for what is wrong; empty where nothing is."""
        progress, now = self._progress, time.monotonic()
        if progress is None:
            return ""
        if progress.still_enabled:
            return "PRESS E-STOP"
        if progress.abort is not None:
            return "ABORT"
        if now - self._near_at < LATELY_S:
            return "LIMIT NEAR"
        return "SAMPLES LOST" if now - self._lost_at < LATELY_S else ""

    def gauges(self) -> list[Gauge]:
        """Return all that has a limit, in the order in which it is shown."""
        if self._progress is None or self._progress.row is None:
            return []
        gauges = []
        for drive, found in zip(self._rig.drive, self._progress.row.drives, strict=True):
            gauges.append(Gauge(f"{drive.joint} angle", found.angle, *drive.angle_rad, "rad"))
            gauges.append(
                Gauge(
                    f"{drive.joint} torque", found.torque, -drive.torque_nm, drive.torque_nm, "N·m"
                )
            )
        limit = self._rig.safety.cuff_force_n
        for cuff, force in zip(CUFFS, self._forces, strict=True):
            strongest = force[np.argmax(np.abs(force))]  # NaN where one of the three is
            gauges.append(Gauge(cuff, float(strongest), -limit, limit, "N"))
        return gauges

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """Draw into the width and height there is."""
        for line in self.lines(options.max_width, options.height or 24):
            for text, style in line:
                yield Segment(text, style)
            yield Segment.line()

    def lines(self, width: int, height: int) -> Iterator[Line]:
        """Yield the picture, line by line, none longer than ``width``: what does not fit is cut
        off."""
        for line in self._lines(width, height):
            room, kept = width, []
            for text, style in line:
                kept.append((text[:room], style))
                room -= len(kept[-1][0])
            yield kept

    def _lines(self, width: int, height: int) -> Iterator[Line]:
        if self._progress is None:
            return
        rows = max(height - 1 - ABOVE - BELOW, 0)  # the last row stays free, or a terminal scrolls
        word = self.word()
        is_small = rows < HEIGHT or width < len(big(word)[0])
        yield self._head(width, word if is_small else "")
        yield []
        columns = width - PANEL - 2
        leg = self._leg(columns, rows) if columns >= SMALLEST_LEG else [""] * rows
        for drawn, line in zip(leg, [*self._panel(word), *[[]] * rows], strict=False):
            yield [(f"{drawn}  " if drawn else "", PLAIN), *line]
        yield []
        for text in wrap(
            self._progress.abort or "", max(width - 1, 4), max_lines=BELOW - 1, placeholder="..."
        ):
            yield [(text, URGENT)]

    def _head(self, width: int, word: str) -> Line:
        """Return the first line, beginning with the state, or with a word for which there is no
        room elsewhere."""
        progress = self._progress
        assert progress is not None
        state = f" {word or progress.state.upper()} "
        when = f"{max(progress.time_s, 0.0):.1f} of {progress.duration_s:.1f} s"
        room = max(width - len(state) - len(when) - 3, 0)
        return [
            (state, SHOUT if progress.abort else Style(reverse=True)),
            (f" {self._run:<{room}.{room}} {when}", PLAIN),
        ]

    def _panel(self, word: str) -> list[Line]:
        progress = self._progress
        assert progress is not None
        lines: list[Line] = [[(text, URGENT)] for text in big(word)]
        gauges = [gauge.line() for gauge in self.gauges()]
        if not gauges:
            return [*lines, [], [("nothing has been measured yet", FAINT)]]
        counted = f"{progress.samples} samples, {progress.missed} missed in {progress.gaps} gaps"
        rate = [
            (f"{progress.rate_hz:.0f} Hz  ", PLAIN),
            (counted, URGENT if progress.missed else PLAIN),
        ]
        return [*lines, [], *gauges[:-4], [], *gauges[-4:], [], rate]

    def _leg(self, columns: int, rows: int) -> list[str]:
        canvas = Canvas(columns, rows)
        row = None if self._progress is None else self._progress.row
        if row is None or rows < HEIGHT or not np.isfinite(row.angle).all():
            return canvas.text()
        place = self._scaled(canvas)
        hip, knee, ankle, toe = (place(point) for point in leg(*row.angle[:2]))
        # Straight down, to see the angle against.
        canvas.line(hip, place(np.array([0.0, -2.0])), every=3)
        canvas.line(hip - BELT, hip + BELT)
        canvas.line(hip, knee, thickness=3)
        canvas.line(knee, ankle, thickness=2)
        canvas.line(ankle, toe, thickness=2)
        for joint in (hip, knee):
            canvas.line(joint, joint, thickness=5)
        return canvas.text()

    def _scaled(self, canvas: Canvas) -> Callable[[NDArray], NDArray]:
        """Return where on a canvas a place in thigh lengths is: all that the limits allow is on
        it."""
        low, high = self._corners
        room = np.array(canvas.size) - 6.0
        scale = np.min(room / (high - low))
        corner = 3.0 + 0.5 * (room - scale * (high - low))
        return lambda point: corner + scale * np.array([point[0] - low[0], high[1] - point[1]])


def leg(hip: float, knee: float) -> NDArray:
    """Return hip, knee, ankle and toe seen from the right, (4, 2) thigh lengths from the hip:
    forward, upward.

    Hip angle from the downward vertical, forward positive; knee relative to the thigh, flexion
    negative. The shank is drawn as long as the thigh, whatever it is.
    """
    thigh, shank, foot = hip, hip + knee, hip + knee + np.pi / 2
    segments = ((0.0, thigh), (1.0, thigh), (1.0, shank), (0.2, foot))
    return np.cumsum(
        [[length * np.sin(angle), -length * np.cos(angle)] for length, angle in segments], axis=0
    )


def plain_line(progress: "Progress") -> str:
    """Return the progress in a line, for where there is no terminal."""
    head = f"{progress.state:<10} {progress.time_s:6.1f}/{progress.duration_s:.1f} s"
    if progress.row is not None:
        angles = ", ".join(f"{drive.angle:+.3f}" for drive in progress.row.drives)
        torques = ", ".join(f"{drive.torque:+.1f}" for drive in progress.row.drives)
        head += (
            f"  {angles} rad  {torques} N·m  {progress.rate_hz:.0f} Hz  {progress.missed} missed"
        )
    urgent = "USE THE EMERGENCY STOP  " if progress.still_enabled else ""
    return f"{urgent}{head}  {progress.abort}" if progress.abort else urgent + head

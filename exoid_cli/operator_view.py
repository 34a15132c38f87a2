"""The operator's view of a run: state, urgent action, and every value between its limits."""

import time
from collections.abc import Iterator
from itertools import chain
from textwrap import wrap
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from rich.console import Console, ConsoleOptions, RenderResult
from rich.segment import Segment
from rich.style import Style

if TYPE_CHECKING:
    from pipelines.acquisition.progress import Progress
    from pipelines.settings.rig import RigSettings

# Blue and orange differ to everyone, and words repeat whatever a colour says.
PLAIN, FAINT = Style(), Style(dim=True)
URGENT = Style(color="dark_orange", bold=True)

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
        """Position between the limits, 0 to 1 within them."""
        return (self.value - self.low) / (self.high - self.low)

    @property
    def near(self) -> bool:
        """Whether a limit is near, or passed."""
        # Share of the range between two limits within which one of them is near.
        near_share = 0.05
        return not near_share <= self.share <= 1.0 - near_share

    def line(self) -> Line:
        """Return value and bar; an exclamation mark shows that a limit is near."""
        # Columns of a bar.
        bar = 13
        if np.isnan(self.value):
            return [(f"{self.name:<11}   not read", FAINT)]
        position = round(min(max(self.share, 0.0), 1.0) * (bar - 1))
        style = URGENT if self.near else Style(color="bright_blue")
        value = f"{self.value:+.2f} {self.unit}"
        return [
            (f"{self.name:<11}", PLAIN),
            (f"{value:>12}{'!' if self.near else ' '}", style),
            (f"{self.low:>6g} ", FAINT),
            ("─" * position, FAINT),
            ("█", style),
            ("─" * (bar - 1 - position), FAINT),
            (f" {self.high:<5g}", FAINT),
        ]


class OperatorView:
    """The picture of a run, drawn by rich from the latest progress.

    ``update`` draws nothing and never waits: a slow terminal, or one stopped by Ctrl-S, must not
    keep the leg waiting.
    """

    def __init__(self, rig: "RigSettings", run: str) -> None:
        self._rig = rig
        self._run = run
        self._progress: Progress | None = None
        self._forces = np.full((4, 3), np.nan)
        # In the past, so that no warning is shown at the start.
        self._lost_at = self._near_at = float("-inf")

    def update(self, progress: "Progress") -> None:
        """Set the progress to show."""
        if progress.row is not None:
            # A sensor that is read every second cycle keeps its last value.
            forces = progress.row.forces
            self._forces = np.where(np.isnan(forces), self._forces, forces)
        if self._progress is not None and progress.missed > self._progress.missed:
            self._lost_at = time.monotonic()
        self._progress = progress
        if any(gauge.near for gauge in chain(*self._gauges()) if not np.isnan(gauge.value)):
            self._near_at = time.monotonic()

    def alert(self) -> str:
        """Return the instruction or warning in capitals; empty if all is well."""
        # Time for which a warning stays after its cause is over, s; a shorter one would be missed.
        shown_s = 3.0
        progress, now = self._progress, time.monotonic()
        if progress is None:
            return ""
        # The most urgent first: with drives enabled after a stop, only the operator can act.
        if progress.still_enabled:
            return "USE THE EMERGENCY STOP"
        if progress.abort is not None:
            return "ABORT"
        if now - self._near_at < shown_s:
            return "LIMIT NEAR"
        return "SAMPLES LOST" if now - self._lost_at < shown_s else ""

    def _gauges(self) -> tuple[list[Gauge], list[Gauge]]:
        """Return every value that has limits, of joints and of cuffs, in the order shown."""
        joints: list[Gauge] = []
        cuffs: list[Gauge] = []
        if self._progress is None or self._progress.row is None:
            return joints, cuffs
        for drive, reading in zip(self._rig.drive, self._progress.row.drives, strict=True):
            limit = drive.torque_nm
            joints.append(Gauge(f"{drive.joint} angle", reading.angle, *drive.angle_rad, "rad"))
            joints.append(Gauge(f"{drive.joint} torque", reading.torque, -limit, limit, "N·m"))
        limit = self._rig.safety.cuff_force_n
        names = ("thigh front", "thigh back", "shank front", "shank back")
        for name, force in zip(names, self._forces, strict=True):
            strongest = force[np.argmax(np.abs(force))]  # NaN if one of the three is
            cuffs.append(Gauge(name, float(strongest), -limit, limit, "N"))
        return joints, cuffs

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """Draw the picture into the given width and height."""
        for line in self.lines(options.max_width, options.height or 24):
            for text, style in line:
                yield Segment(text, style)
            yield Segment.line()

    def lines(self, width: int, height: int) -> Iterator[Line]:
        """Yield the lines of the picture, cut off to the width and height."""
        # The last row stays free, or a terminal would scroll.
        for line in self._lines(width)[: height - 1]:
            room, cut = width, []
            for text, style in line:
                cut.append((text[:room], style))
                room -= len(cut[-1][0])
            yield cut

    def _lines(self, width: int) -> list[Line]:
        # Most lines of the reason for a stop.
        abort_lines = 3
        progress = self._progress
        if progress is None:
            return []
        room = max(width - 1, 4)
        reason = wrap(progress.abort or "", room, max_lines=abort_lines, placeholder="...")
        head = [self._head(progress, width), *[[(text, URGENT)] for text in reason], []]
        joints, cuffs = ([gauge.line() for gauge in some] for some in self._gauges())
        if not joints:
            return [*head, [("nothing has been measured yet", FAINT)]]
        counts = f"{progress.samples} samples, {progress.missed} missed in {progress.gaps} gaps"
        rate = [
            (f"{progress.rate_hz:.0f} Hz  ", PLAIN),
            (counts, URGENT if progress.missed else PLAIN),
        ]
        return [*head, *joints, [], *cuffs, [], rate]

    def _head(self, progress: "Progress", width: int) -> Line:
        """Return the first line: the alert if any, the state, the run and the time."""
        alert, reverse = self.alert(), Style(reverse=True)
        words = [(f" {alert} ", URGENT + reverse)] if alert else []
        words.append((f" {progress.state.upper()} ", reverse))
        elapsed = f"{max(progress.time_s, 0.0):.1f} of {progress.duration_s:.1f} s"
        room = max(width - sum(len(text) for text, _ in words) - len(elapsed) - 3, 0)
        return [*words, (f" {self._run:<{room}.{room}} {elapsed}", PLAIN)]


def plain_line(progress: "Progress") -> str:
    """Return the progress in a line, for output that is not a terminal."""
    urgent = "USE THE EMERGENCY STOP  " if progress.still_enabled else ""
    text = f"{urgent}{progress.state:<10} {progress.time_s:6.1f}/{progress.duration_s:.1f} s"
    if progress.row is not None:
        angles = ", ".join(f"{drive.angle:+.3f}" for drive in progress.row.drives)
        torques = ", ".join(f"{drive.torque:+.1f}" for drive in progress.row.drives)
        text += f"  {angles} rad  {torques} N·m  {progress.rate_hz:.0f} Hz"
        text += f"  {progress.missed} missed"
    return f"{text}  {progress.abort}" if progress.abort else text

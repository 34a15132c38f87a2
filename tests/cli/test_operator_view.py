"""The operator sees every value that has limits, and first of all what to do at once."""

import io
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from exoid_cli.operator_view import Gauge, OperatorView, plain_line
from pipelines.acquisition.machine.reading import Reading
from pipelines.acquisition.machine.row import Row
from pipelines.acquisition.progress import Progress
from pipelines.acquisition.states import State
from pipelines.settings import datasets
from pipelines.settings.rig import load_rig

RIG = load_rig(datasets() / "rigs" / "plain.toml")
ABORTS = (
    "knee torque 151.0 N·m is above its limit of 110 N·m",
    "thigh_back force y 431 N is above the limit of 400 N",
    "watchdog: no new sample from drive hip (127.0.0.1:502, unit 1) for 0.102 s, allowed are 0.1 s",
    "drive hip: 127.0.0.1:502 does not answer; is the cable plugged in?",
    "stopped by Ctrl-C",
    "a fault of exoid's own (ZeroDivisionError('division by zero'))",
)


def progress(state=State.RUN, hip=0.5, knee=-0.9, torque=31.0, force=20.0, **changes):
    readings = (
        Reading(7, 0.1, hip, torque, 0, 0, 20, hip),
        Reading(7, 0.1, knee, -4.0, 0, 0, 20, knee),
    )
    forces = np.full((4, 3), np.nan)
    forces[1] = -2.0, force, 0.5
    default = Progress(
        state, time_s=12.3, duration_s=40.0, row=Row(readings, forces), samples=2460, rate_hz=200.0
    )
    return replace(default, **changes)


def view(*steps):
    operator_view = OperatorView(RIG, "with_human_train")
    for step in steps:
        operator_view.update(step)
    return operator_view


def picture(operator_view, width=80, height=24):
    return ["".join(text for text, _ in line) for line in operator_view.lines(width, height)]


def terminal_output(operator_view):
    """Return what a terminal receives, escape sequences included."""
    screen = Console(
        file=io.StringIO(), force_terminal=True, color_system="256", width=80, height=24
    )
    screen.print(operator_view)
    return screen.file.getvalue()


@pytest.mark.parametrize(
    ("value", "near", "position"),
    [
        (-10.0, True, 0),
        (-8.9, False, 1),
        (0.0, False, 6),
        (8.9, False, 11),
        (9.2, True, 12),
        (10.0, True, 12),
        (50.0, True, 12),
        (-50.0, True, 0),
    ],
)
def test_a_bar_is_at_its_end_at_a_limit_and_marks_what_is_near(value, near, position):
    gauge = Gauge("hip torque", value, -10.0, 10.0, "N·m")
    text = "".join(part for part, _ in gauge.line())
    assert text[31:44].index("█") == position
    assert ("!" in text) == gauge.near == near


def test_a_sensor_that_is_not_read_says_so_and_one_read_each_second_cycle_keeps_its_value():
    between = progress()
    between.row.forces[:] = np.nan
    lines = picture(view(progress(force=85.0), between))
    assert any("thigh back" in line and "+85.00 N" in line for line in lines)
    assert any("thigh front" in line and "not read" in line for line in lines)


@pytest.mark.parametrize("reason", ABORTS)
@pytest.mark.parametrize("state", [State.ABORT, State.DISABLED])
def test_an_abort_is_the_first_word_and_its_reason_stands_below(reason, state):
    head, *lines = picture(view(progress(state, abort=reason)))
    assert head.startswith(f" ABORT  {state.upper()} ")
    assert reason.replace(" ", "") in "".join(lines).replace(" ", "")


@pytest.mark.parametrize(("width", "height"), [(80, 24), (80, 7), (40, 5), (30, 24), (14, 3)])
def test_a_drive_that_could_not_be_disabled_is_the_first_thing_to_read(width, height):
    stuck = view(progress(State.ABORT, abort=ABORTS[2], still_enabled=True))
    assert picture(stuck, width, height)[0].startswith(" USE THE EMERGENCY STOP"[:width])


@pytest.mark.parametrize(
    "close", [{"hip": 1.72}, {"knee": -2.05}, {"torque": 145.0}, {"force": -390.0}]
)
def test_a_near_limit_raises_an_alert_that_stays_for_a_while(close):
    assert view(progress()).alert() == ""
    assert view(progress(**close), progress()).alert() == "LIMIT NEAR"


def test_missed_samples_raise_an_alert_and_are_counted():
    lossy = view(progress(), progress(missed=3, gaps=2))
    assert lossy.alert() == "SAMPLES LOST"
    assert any("3 missed in 2 gaps" in line for line in picture(lossy))


def test_all_limits_fit_on_a_terminal_of_24_lines_next_to_a_long_reason():
    stopped = view(progress(State.ABORT, abort=" ".join(ABORTS), missed=3, gaps=2))
    assert sum("█" in line or "not read" in line for line in picture(stopped)) == 8
    assert "3 missed in 2 gaps" in picture(stopped)[-1]


@pytest.mark.parametrize(
    "step",
    [
        progress(State.CHECK, row=None),
        progress(),
        progress(hip=1.74, knee=-2.09, torque=-149.0, force=-399.0),
        progress(State.ABORT, abort=" ".join(ABORTS), missed=123456, gaps=9999, samples=10**8),
        progress(State.ABORT, abort="x" * 300, still_enabled=True),
        progress(time_s=86399.9, duration_s=86400.0),
        progress(hip=-1234.5, torque=1e6),
        progress(hip=np.nan, torque=np.nan),
    ],
)
@pytest.mark.parametrize("size", [(80, 24), (120, 40), (81, 10), (200, 60)])
def test_no_picture_leaves_its_screen(step, size):
    lines = picture(view(step), *size)
    assert max(map(len, lines)) <= size[0]
    assert len(lines) < size[1]


@pytest.mark.parametrize("width", [1, 20, 50, 70])
def test_a_narrow_window_is_filled_and_never_left(width):
    screen = Console(file=io.StringIO(), width=width, height=24)
    screen.print(view(progress(State.ABORT, abort=ABORTS[0])))
    assert max(map(len, screen.file.getvalue().splitlines())) <= width


def test_without_colour_a_near_limit_is_marked_too(monkeypatch):
    monkeypatch.delenv("NO_COLOR", raising=False)
    near = view(progress(hip=1.72))
    blue, orange = "\x1b[94m", "38;5;208m"
    assert all(colour in terminal_output(near) for colour in (blue, orange))
    monkeypatch.setenv("NO_COLOR", "1")
    assert not any(colour in terminal_output(near) for colour in (blue, orange))
    assert "+1.72 rad!" in terminal_output(near)


def test_without_a_terminal_a_line_holds_the_same_values():
    assert (
        plain_line(progress(knee=-2.08, missed=1))
        == "run          12.3/40.0 s  +0.500, -2.080 rad  +31.0, -4.0 N·m  200 Hz  1 missed"
    )
    assert plain_line(progress(State.ABORT, row=None, abort="stopped by Ctrl-C")).endswith(
        "stopped by Ctrl-C"
    )
    urgent = plain_line(progress(State.ABORT, abort="x" * 300, still_enabled=True))
    assert urgent.startswith("USE THE EMERGENCY STOP"), "what to do at once comes first"

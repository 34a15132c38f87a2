"""What the operator sees: the leg as it stands, all that has limits, and one big word when
something is wrong."""

import io
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from rich.console import Console

from exoid_cli.big_word import big
from exoid_cli.canvas import Canvas
from exoid_cli.operator_view import Gauge, OperatorView, leg, plain_line
from pipelines.acquisition.machine.drive import Reading
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
    made = Progress(
        state, time_s=12.3, duration_s=40.0, row=Row(readings, forces), samples=2460, rate_hz=200.0
    )
    return replace(made, **changes)


def view(*taken):
    made = OperatorView(RIG, "with_human_train")
    for one in taken:
        made.take(one)
    return made


def picture(made, width=80, height=24):
    return ["".join(text for text, _ in line) for line in made.lines(width, height)]


def shown(made):
    """What a terminal gets, escape sequences included."""
    screen = Console(
        file=io.StringIO(), force_terminal=True, color_system="256", width=80, height=24
    )
    screen.print(made)
    return screen.file.getvalue()


def has_word(lines, word):
    return all(any(row.rstrip() in line for line in lines) for row in big(word) if row.strip())


def test_a_leg_at_zero_hangs_straight_down_and_its_foot_points_forward():
    hip, knee, ankle, toe = leg(0.0, 0.0)
    assert_allclose([hip, knee, ankle], [[0, 0], [0, -1], [0, -2]], atol=1e-12)
    assert toe[0] > 0.1
    assert toe[1] == pytest.approx(-2.0)


def test_the_thigh_goes_forward_with_the_hip_and_the_shank_back_with_a_bent_knee():
    _, knee, ankle, _ = leg(np.pi / 2, -np.pi / 2)
    assert_allclose([knee, ankle], [[1, 0], [1, -1]], atol=1e-12)


def drawn(lines):
    """Which dots of a picture are set, from the characters alone."""
    rows = [[ord(c) - 0x2800 if "\u2800" <= c <= "\u28ff" else 0 for c in line] for line in lines]
    codes = np.array([row + [0] * (max(map(len, rows)) - len(row)) for row in rows])
    bits = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])
    return (
        (codes[:, None, :, None] & bits[None, :, None, :]).astype(bool).reshape(4 * len(rows), -1)
    )


def test_on_the_screen_forward_is_right_and_down_is_down():
    hanging, forward, back = (
        np.argwhere(drawn(picture(view(progress(hip=hip, knee=0.0))))) for hip in (0.0, 1.2, -0.3)
    )
    assert np.ptp(hanging[:, 0]) > 2 * np.ptp(hanging[:, 1])
    assert forward[:, 1].max() > hanging[:, 1].max() + 10
    assert back[:, 1].min() < hanging[:, 1].min()


@pytest.mark.parametrize("hip", [RIG.drive[0].angle_rad[0], 0.3, RIG.drive[0].angle_rad[1]])
@pytest.mark.parametrize("knee", [RIG.drive[1].angle_rad[0], -0.3, RIG.drive[1].angle_rad[1]])
def test_the_ankle_is_on_the_canvas_wherever_the_limits_let_it_go(hip, knee):
    canvas = Canvas(28, 16)
    place = view(progress())._scaled(canvas)
    for point in leg(hip, knee):
        assert np.all(place(point) >= 0)
        assert np.all(place(point) < canvas.size)


@pytest.mark.parametrize(
    ("value", "near", "place"),
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
def test_a_bar_is_at_its_end_at_a_limit_and_marks_what_is_near(value, near, place):
    gauge = Gauge("hip torque", value, -10.0, 10.0, "N·m")
    text = "".join(part for part, _ in gauge.line())
    assert text[31:44].index("█") == place
    assert ("!" in text) == gauge.near == near


def test_a_sensor_that_is_not_read_says_so_and_one_read_each_second_cycle_keeps_its_value():
    between = progress()
    between.row.forces[:] = np.nan
    lines = picture(view(progress(force=85.0), between))
    assert any("thigh back" in line and "+85.00 N" in line for line in lines)
    assert any("thigh front" in line and "not read" in line for line in lines)


@pytest.mark.parametrize("why", ABORTS)
@pytest.mark.parametrize("state", [State.ABORT, State.DISABLED])
def test_every_abort_is_one_big_word_and_its_reason_stands_below(why, state):
    lines = picture(view(progress(state, abort=why)))
    assert has_word(lines, "ABORT")
    assert why.replace(" ", "") in "".join(lines).replace(" ", "")


def test_a_drive_that_could_not_be_disabled_is_more_than_an_abort():
    lines = picture(
        view(
            progress(
                State.ABORT, abort=f"{ABORTS[2]}; and could not be disabled", still_enabled=True
            )
        )
    )
    assert has_word(lines, "PRESS E-STOP")
    assert not has_word(lines, "ABORT")


@pytest.mark.parametrize(("width", "height"), [(80, 7), (40, 5), (30, 24), (14, 3)])
def test_on_a_screen_without_room_for_the_big_word_it_is_the_first_that_is_read(width, height):
    made = view(progress(State.ABORT, abort="knee torque", still_enabled=True))
    assert picture(made, width, height)[0].startswith(" PRESS E-STOP"[:width])


@pytest.mark.parametrize(
    "close", [{"hip": 1.72}, {"knee": -2.05}, {"torque": 145.0}, {"force": -390.0}]
)
def test_a_limit_that_is_near_is_said_and_stays_said_for_a_while(close):
    assert view(progress()).word() == ""
    assert view(progress(**close), progress()).word() == "LIMIT NEAR"


def test_samples_that_were_missed_are_said_and_counted():
    made = view(progress(), progress(missed=3, gaps=2))
    assert made.word() == "SAMPLES LOST"
    assert any("3 missed in 2 gaps" in line for line in picture(made))


@pytest.mark.parametrize(
    "taken",
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
def test_no_picture_leaves_its_screen(taken, size):
    lines = picture(view(taken), *size)
    assert max(map(len, lines)) <= size[0]
    assert len(lines) < size[1]


@pytest.mark.parametrize("width", [1, 20, 50, 70])
def test_a_narrow_window_is_filled_and_never_left(width):
    screen = Console(file=io.StringIO(), width=width, height=24)
    screen.print(view(progress(State.ABORT, abort=ABORTS[0])))
    assert max(map(len, screen.file.getvalue().splitlines())) <= width


def test_without_colour_the_same_is_told(monkeypatch):
    monkeypatch.delenv("NO_COLOR", raising=False)
    made = view(progress(hip=1.72))
    blue, orange = "\x1b[94m", "38;5;208m"
    assert all(colour in shown(made) for colour in (blue, orange))
    monkeypatch.setenv("NO_COLOR", "1")
    assert not any(colour in shown(made) for colour in (blue, orange))
    assert "+1.72 rad!" in shown(made)


def test_without_a_terminal_a_line_tells_the_same():
    assert (
        plain_line(progress(knee=-2.08, missed=1))
        == "run          12.3/40.0 s  +0.500, -2.080 rad  +31.0, -4.0 N·m  200 Hz  1 missed"
    )
    assert plain_line(progress(State.ABORT, row=None, abort="stopped by Ctrl-C")).endswith(
        "stopped by Ctrl-C"
    )
    urgent = plain_line(progress(State.ABORT, abort="x" * 300, still_enabled=True))
    assert urgent.startswith("USE THE EMERGENCY STOP"), "what somebody must do at once comes first"

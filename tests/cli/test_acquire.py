import numpy as np
from rich.console import Console

from exoid_cli.acquire import _line, _picture
from pipelines.acquisition.loop import Progress
from pipelines.acquisition.machine import Reading, Row
from pipelines.settings import datasets
from pipelines.settings.rig import load_rig


def progress():
    hip = Reading(7, 0.1, 0.5, 31.0, 0.0, 0.0, 20.0, 0.5)
    knee = Reading(7, 0.1, -2.08, -4.0, 0.0, 0.0, 20.0, -2.08)
    forces = np.full((4, 3), np.nan)
    forces[1] = -2.0, 85.0, 0.5
    return Progress("run", 12.3, 40.0, Row((hip, knee), forces), 2460, 1, 200.0)


def test_the_operator_sees_angles_torques_and_forces_between_their_limits_and_what_was_missed():
    screen = Console(width=100, record=True, file=open("/dev/null", "w"))  # noqa: SIM115
    screen.print(_picture(progress(), load_rig(datasets() / "rigs" / "plain.toml")))
    text = screen.export_text()
    screen.file.close()
    for words in ("run", "12.3 of 40.0 s", "+0.500 rad", "-0.35 to 1.75", "+31.000 N·m", "+85.000 N", "1 missed"):
        assert words in text
    assert "thigh front" not in text  # not read


def test_without_a_terminal_a_line_tells_the_same():
    assert _line(progress()) == (
        "run           12.3 of 40.0 s  angles +0.500, -2.080 rad  torques +31.0, -4.0 N·m  200 Hz  1 missed"
    )

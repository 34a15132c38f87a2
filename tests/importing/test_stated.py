"""What a file says in words of its values is repeated."""

import numpy as np
import pytest

from tests.importing.conftest import MAP


def _lines(pendulum):
    return [
        f"{t:.3f},{a:.6f},{v:.6f},{m:.6f}\n"
        for t, a, v, m in zip(*pendulum.columns().values(), strict=True)
    ]


@pytest.mark.parametrize(
    ("fact", "is_named"),
    [
        ("Gravity correction:,ON,Limb torque:,12.0 N-m at 90 deg", True),
        ("# friction compensated by the software", True),
        ("Schwerkraftkorrektur: ein", True),
        ("Tare: 1.85", True),
        ("Gravity correction:,OFF,Limb torque:,0", False),
        ("Tare: 0.00", False),
        ("moments are not normalized", False),
        ("Target speed: 60", False),
    ],
)
def test_a_line_that_says_that_values_were_corrected_is_repeated(
    imported, pendulum, tmp_path, fact, is_named
):
    path = tmp_path / "log.csv"
    path.write_text("".join([f"{fact}\n", "time,angle,velocity,torque\n", *_lines(pendulum)]))
    printed = imported(path).printed
    assert ("the file says above the rows" in printed) == is_named


def test_the_name_of_a_corrected_torque_is_named_and_that_of_another_column_is_not(
    imported, pendulum, tmp_path
):
    path = tmp_path / "log.csv"
    header = "time,angle,velocity,gravity corrected torque\n"
    path.write_text("".join([header, *_lines(pendulum)]))
    text = MAP.replace('"torque"', '"gravity corrected torque"')
    assert "says that it was altered: 'gravity corrected" in imported(path, map_text=text).printed
    path.write_text("".join(["time,angle,velocity,torque,tare\n", *_others(pendulum)]))
    assert "altered" not in imported(path).printed
    assert "the file says" not in imported(path).printed


def _others(pendulum):
    return [line.replace("\n", ",0\n") for line in _lines(pendulum)]


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_a_comment_between_the_rows_is_repeated_with_its_line(imported, pendulum, tmp_path, end):
    rows, header = _lines(pendulum), ["# bench 4\n", "time,angle,velocity,torque\n"]
    said = "# tare torque: 1.85 N·m removed from here on\n"
    path = tmp_path / "log.csv"
    # Behind what the dialect is derived from; and a header that comes again is none.
    lines = [*header, *rows[:1900], said, "# ----\n", *rows[1900:1950], *header, *rows[1950:]]
    path.write_bytes("".join(lines).replace("\n", end).encode())
    assert path.read_bytes().index(b"tare") > 2**16
    outcome = imported(path)
    assert "line 1903: 'tare torque: 1.85 N·m removed from here on'" in outcome.printed
    assert outcome.printed.count("the file says") == 1
    assert len(outcome.recording().frame) == 2000


def test_a_unit_that_changes_from_row_to_row_is_named(imported, pendulum, write_csv):
    small = np.abs(pendulum.torque) < 1.0
    columns = pendulum.columns() | {"torque": np.where(small, 1e3, 1.0) * pendulum.torque}
    printed = imported(write_csv(columns | {"M unit": np.where(small, "mNm", "Nm")})).printed
    assert "'M unit' is" in printed and "all read in the unit of the map" in printed
    printed = imported(write_csv(columns | {"M unit": np.full(len(small), "Nm")})).printed
    assert "M unit" not in printed

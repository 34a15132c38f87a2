"""How many samples a second fit through a line."""

import re
from math import floor
from pathlib import Path

import pytest

from pipelines.acquisition.modbus.line_rate import highest_rate
from pipelines.settings import datasets
from pipelines.settings.rig import load_rig

DOCS = Path(__file__).parents[3] / "docs"


def on_serial_lines(rig_file, apart, baud_rate, silence):
    """Return the shipped rig with its drives on one serial line, or on one each."""
    names = ("hip", "knee") if apart else ("hip", "hip")
    keys = f'transport = "rtu"\nbaud_rate = {baud_rate}\n{silence}\n'
    tables = "".join(
        f'[line.{name}]\nserial_port = "{name}"\n{keys}' for name in dict.fromkeys(names)
    )
    units = {
        f"unit = {i + 1}\n": f'unit = {i + 1}\nline = "{name}"\n' for i, name in enumerate(names)
    }
    replace = {**units, "[map.drive.servo]\n": tables + "[map.drive.servo]\n"}
    return load_rig(rig_file(shipped="real_time", replace=replace))


@pytest.mark.parametrize(
    ("apart", "baud_rate", "silence", "rate"),
    [(False, 115200, "", 45), (True, 115200, "", 58), (False, 921600, "silence_s = 0.0002", 378)],
)
def test_docs_state_the_rates_of_serial_lines(rig_file, apart, baud_rate, silence, rate):
    rig = on_serial_lines(rig_file, apart, baud_rate, silence)
    assert floor(highest_rate(rig, with_sensors=False)[0]) == rate
    page = (DOCS / "rig.md").read_text()
    assert re.search(rf"\b{rate}\b", page)


def test_sensors_on_a_line_take_their_share_of_every_sample_that_reads_them(rig_file):
    on_it = {f'map = "{kind}"': f'map = "{kind}"\nline = "leg"' for kind in ("servo", "force")}
    table = '[line.leg]\ntransport = "rtu"\nserial_port = "x"\n'
    rig = load_rig(
        rig_file(
            shipped="real_time",
            replace={**on_it, "[map.drive.servo]\n": table + "[map.drive.servo]\n"},
        )
    )
    # Characters of 11 bits at 19200 baud, and 3.5 of silence before each of the frames: 2 of the
    # look, 4 of the drives.
    character = 11 / 19200
    look, drives, sensors = (17 + 7) * character, 2 * (52 + 7) * character, 4 * (29 + 7) * character
    assert highest_rate(rig, with_sensors=False) == (pytest.approx(1 / (look + drives)), "leg")
    assert highest_rate(rig, with_sensors=True) == (
        pytest.approx(1 / (look + drives + sensors)),
        "leg",
    )
    # Two of the four are read every third cycle, in turns: one of them with the other two at
    # most.
    seldom = rig.model_copy(
        update={
            "sensor": tuple(
                s.model_copy(update={"every": 3 if i < 2 else 1}) for i, s in enumerate(rig.sensor)
            )
        }
    )
    sensors *= 3 / 4
    assert highest_rate(seldom, with_sensors=True) == (
        pytest.approx(1 / (look + drives + sensors)),
        "leg",
    )


def test_what_drives_record_themselves_takes_its_share_of_a_line(rig_file):
    def highest(baud_rate, **changes):
        table = (
            f'[line.leg]\ntransport = "rtu"\nserial_port = "x"\nbaud_rate = {baud_rate}\nsilence_s'
            " = 0.0002\n"
        )
        on_it = {
            'map = "servo"': 'map = "servo"\nline = "leg"',
            "[map.drive.servo]\n": table + "[map.drive.servo]\n",
        }
        return highest_rate(
            load_rig(rig_file(shipped="recorder", replace=on_it, **changes)), with_sensors=False
        )[0]

    # 12 records of 10 registers a read, and the number of the newest after it: 253 and 17
    # characters of 11 bits.
    character = 11 / 1e6
    cycle = (17 + 2 * 52) * character + 3 * 4e-4
    drain = 2 * ((253 + 17) * character + 2 * 4e-4)
    assert highest(1000000) == pytest.approx(
        min(1 / (cycle + drain), (1 - drain * 1000 / 12) / cycle)
    )
    # At 115200 baud a second of records takes longer than a second, however seldom set-points go
    # out.
    assert highest(115200) == 0.0
    assert 0.0 < highest(115200, record_rate_hz=100) < 1000 / 12


def test_the_speed_of_a_network_is_unknown(rig_file):
    table = '[line.leg]\ntransport = "tcp"\n'
    changes = {
        'map = "servo"': 'map = "servo"\nline = "leg"',
        "[map.drive.servo]\n": table + "[map.drive.servo]\n",
    }
    assert highest_rate(load_rig(rig_file(replace=changes)), with_sensors=True) == (
        float("inf"),
        None,
    )


def test_the_template_states_the_rate_of_its_lines_which_is_enough():
    path = datasets() / "rigs" / "lab.toml"
    rate, _ = highest_rate(load_rig(path), with_sensors=True)
    assert f"at most {floor(rate)} samples a second fit" in path.read_text()
    assert rate > 100.0

"""How many samples a second fit through a line."""

import re
from math import floor
from pathlib import Path

import pytest

from pipelines.acquisition.line_rate import highest_rates
from pipelines.settings.rig import load_rig

DOCS = Path(__file__).parents[2] / "docs"


def on_serial_lines(rig_file, apart, baud_rate, silence):
    """Return the shipped rig with its drives on one serial line, or on one each."""
    names = ("hip", "knee") if apart else ("hip", "hip")
    keys = f'transport = "rtu"\nbaud_rate = {baud_rate}\n{silence}\n'
    tables = "".join(f'[line.{name}]\nserial_port = "{name}"\n{keys}' for name in dict.fromkeys(names))
    units = {f"unit = {i + 1}\n": f'unit = {i + 1}\nline = "{name}"\n' for i, name in enumerate(names)}
    replace = {**units, "[map.drive.servo]\n": tables + "[map.drive.servo]\n"}
    return load_rig(rig_file(shipped="real_time", replace=replace))


@pytest.mark.parametrize(
    ("apart", "baud_rate", "silence", "rate"),
    [(False, 115200, "", 45), (True, 115200, "", 58), (False, 921600, "silence_s = 0.0002", 378)],
)
def test_docs_tell_what_fits_through_serial_lines(rig_file, apart, baud_rate, silence, rate):
    rig = on_serial_lines(rig_file, apart, baud_rate, silence)
    assert floor(min(highest_rates(rig, with_sensors=False).values())) == rate
    page = (DOCS / "rig.md").read_text()
    assert re.search(rf"\b{rate}\b", page)


def test_sensors_take_their_share_of_a_line_and_less_when_read_less_often(rig_file):
    def rate(every, with_sensors=True):
        on_it = {f'map = "{kind}"': f'map = "{kind}"\nline = "leg"' for kind in ("servo", "force")}
        on_it['map = "force"'] += f"\nevery = {every}"
        table = '[line.leg]\ntransport = "rtu"\nserial_port = "x"\n'
        rig = rig_file(shipped="real_time", replace={**on_it, "[map.drive.servo]\n": table + "[map.drive.servo]\n"})
        return highest_rates(load_rig(rig), with_sensors=with_sensors)["leg"]

    assert rate(1) < rate(4) < rate(1, with_sensors=False)


def test_nothing_is_said_of_the_speed_of_a_network(rig_file):
    table = '[line.leg]\ntransport = "tcp"\n'
    changes = {'map = "servo"': 'map = "servo"\nline = "leg"', "[map.drive.servo]\n": table + "[map.drive.servo]\n"}
    assert highest_rates(load_rig(rig_file(replace=changes)), with_sensors=True) == {"leg": float("inf")}

"""The likeliest mistakes in a rig file are tried first, and named with the key to change."""

import struct
from types import SimpleNamespace

import numpy as np
import pytest

from pipelines.acquisition.check.plausible import _check_counter_words
from pipelines.acquisition.check.probe import Series
from pipelines.modbus.register_block import Block
from pipelines.settings.rig import Register

pytestmark = pytest.mark.long

SENSOR_READ = "[map.sensor.force.read]\n"


def lines(report):
    return [f"{f.device}: {f.text}" for f in report.findings if f.device != "rig"]


def moved(by):
    """Changes of the addresses of the sensors' block."""
    names = {100: "sequence", 102: "force_x", 104: "force_y", 106: "force_z"}
    kinds = {100: "uint32"}
    return {
        f'{name} = {{ address = {at}, type = "{kinds.get(at, "float32")}"': (
            f'{name} = {{ address = {at + by}, type = "{kinds.get(at, "float32")}"'
        )
        for at, name in names.items()
        if at != 100
    } | {
        SENSOR_READ + 'sequence = { address = 100, type = "uint32" }': (
            SENSOR_READ + f'sequence = {{ address = {100 + by}, type = "uint32" }}'
        )
    }


@pytest.mark.parametrize(
    ("by", "words"),
    [
        pytest.param(
            -1,
            "all of map.sensor.force.read is one address too low: add 1 to each",
            marks=pytest.mark.slow,
        ),
        (1, "all of map.sensor.force.read is one address too high: subtract 1 from each"),
        (40001, "all of map.sensor.force.read is 40001 too high: subtract it from each"),
    ],
)
def test_a_block_at_a_manuals_addresses_is_found_by_what_it_holds_elsewhere(checked, by, words):
    findings = lines(checked("real_time", believed=moved(by)))
    assert len(findings) == 4
    assert all(words in finding for finding in findings), findings


def test_a_device_that_lacks_a_function_is_named_with_the_one_that_it_has(checked):
    served = {SENSOR_READ: f"{SENSOR_READ}function = 4\n"}
    believed = {f"{SENSOR_READ}function = 4\n": SENSOR_READ}
    findings = lines(checked("real_time", served=served, believed=believed))
    assert findings == [
        f"sensor {cuff}: does not know function 3, but answers 4; set"
        " map.sensor.force.read.function = 4"
        for cuff in ("thigh_front", "thigh_back", "shank_front", "shank_back")
    ]


WRITE = "[map.drive.servo.write]\n"


def test_a_drive_without_function_23_is_found_without_writing_a_register(checked):
    written = set()

    def note(device, function, values):
        written.add(values is not None)

    served = {WRITE: f"{WRITE}function = 16\n"}
    believed = {f"{WRITE}function = 16\n": WRITE}
    findings = lines(checked("real_time", served=served, believed=believed, fault=note))
    assert findings == [
        f"drive {joint}: does not know function 23; set map.drive.servo.write.function = 16"
        for joint in ("hip", "knee")
    ]
    assert written == {False}


def test_a_device_that_answers_few_registers_a_request_is_named_with_how_many(checked):
    served = {SENSOR_READ: f"{SENSOR_READ}most_words = 5\n"}
    believed = {f"{SENSOR_READ}most_words = 5\n": SENSOR_READ}
    findings = lines(checked("real_time", served=served, believed=believed))
    assert [finding.partition(": ")[2] for finding in findings] == [
        "answers 4 registers a request, but not 6; set map.sensor.force.read.most_words = 4"
    ] * 4


def test_a_register_that_does_not_exist_is_named(checked):
    force_z = 'force_z = { address = 106, type = "float32"'
    findings = lines(checked("real_time", believed={force_z: force_z.replace("106", "110")}))
    assert all(
        "has no register 110, which map.sensor.force.read.force_z needs" in f for f in findings
    )
    assert len(findings) == 4


def test_another_unit_is_found_behind_the_same_gateway(checked):
    findings = lines(checked("real_time", believed={"unit = 11\n": "unit = 41\n"}))
    assert findings == [
        "sensor thigh_front: does not answer as unit 41, but unit 11 does; correct unit"
    ]


def test_frames_of_the_other_kind_are_found(checked):
    report = checked(
        "real_time",
        on_a_line=True,
        changed_line={'transport = "tcp"': 'transport = "rtu_over_tcp"'},
        connect_s=1.0,
    )
    assert 'answers in other frames; set transport = "tcp"' in str(report.findings[0])


def test_right_blocks_in_several_requests_have_no_findings(checked):
    served = {
        SENSOR_READ: f"{SENSOR_READ}most_words = 4\nfunction = 4\n",
        "[map.drive.servo.read]": "[map.drive.servo.read]\nmost_words = 8\n",
        WRITE: f"{WRITE}function = 16\n",
    }
    findings = lines(checked("real_time", served=served, real_hz=10.0))
    assert [f for f in findings if "ms to answer" not in f] == []


def test_a_low_word_that_is_the_counter_is_found():
    """High words right, low words from the register before: nearly right, and wrong."""
    counter = Register(address=0, type="uint32")
    noise = np.random.default_rng(0).normal(0.3, 0.5, 30)
    answers = []
    for n, force in enumerate(noise):
        high = struct.unpack(">HH", struct.pack(">f", force))[0]
        answers.append((0.1 * n, 0.1 * n + 0.01, [0, n, n, high]))
    probe = SimpleNamespace(map_path="map.sensor.force", finding=lambda text, name: name)

    def found(**changes):
        force = Register(address=2, type="float32", word_order="little", **changes)
        block = Block({"sequence": counter, "force_x": force})
        return list(_check_counter_words(probe, Series.of_answers(block, answers)))

    assert found() == ["force_x"]
    # Where the low word is the value's own, it changes by more than the counter.
    answers = [
        (*instants, [0, n, *struct.unpack(">HH", struct.pack("<f", force)[::-1])[::-1]])
        for n, ((*instants, _), force) in enumerate(zip(answers, noise, strict=True))
    ]
    assert found() == []

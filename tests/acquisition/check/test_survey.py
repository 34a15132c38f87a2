"""Disagreements of a rig with its file are found without moving it, and reported in words."""

import re
import socket
import time
from contextlib import ExitStack

import pytest

from pipelines.acquisition.check import survey
from pipelines.acquisition.check.check import check_rig
from pipelines.errors import DeviceError, SettingsError
from pipelines.rig.device import Device, Sensor
from pipelines.settings.rig import load_rig

pytestmark = pytest.mark.long

ANGLE = 'angle = { address = 104, type = "int32", scale = 1e-6, unit = "rad" }'
TIME = 'time = { address = 102, type = "uint32", unit = "us" }'
VELOCITY = 'velocity = { address = 106, type = "int32", scale = 1e-5, unit = "rad/s" }'
FORCE_Y = 'force_y = { address = 104, type = "float32", unit = "N" }'
TEMPERATURE = 'temperature = { address = 112, type = "int16", scale = 0.1, unit = "°C" }'


def findings_of(report):
    return "\n".join(map(str, report.findings))


def unrelated_to_speed(report):
    """Return the findings of devices, without their slowness: a busy computer is a slow line."""
    findings = [str(finding) for finding in report.findings if finding.device != "rig"]
    return [text for text in findings if "ms to answer, too long" not in text]


@pytest.mark.parametrize(
    ("run", "shipped"),
    [
        ("exo_alone", "plain"),
        ("exo_alone", "real_time"),
        ("with_human", "plain"),
        pytest.param("with_human", "real_time", marks=pytest.mark.slow),
    ],
)
def test_a_right_rig_has_no_findings(checked, shipped, run):
    report = checked(shipped, options={"run": run})
    assert unrelated_to_speed(report) == []
    assert len(report.devices) == 6
    for device in report.devices:
        assert device.connected and all(
            entry["found"] == entry["expected"] for entry in device.identity
        )
        assert (
            0
            < device.latency.min_ms
            <= device.latency.median_ms
            <= device.latency.p99_ms
            <= device.latency.max_ms
        )
        assert sum(device.latency.histogram) == device.latency.count


LOCKSTEP = {'clock = "real_time"': 'clock = "lockstep"'}
RECORDED = 'angle = { address = 4, type = "int32", scale = 1e-6, unit = "rad" }'


def test_a_rig_whose_drives_record_faster_than_set_points_come_has_no_findings(checked):
    report = checked("recorder", served=LOCKSTEP, options={"rate_hz": 200.0})
    assert report.findings == []
    assert report.devices[0].clock.step == 5.0


@pytest.mark.parametrize(
    ("was", "believed", "words"),
    [
        (RECORDED, RECORDED.replace("1e-6", "2e-6"), "while its own record holds"),
        ("address = 1000", "address = 1010", "its record brought no sample in 40 cycles"),
    ],
)
def test_a_record_that_is_not_as_the_file_says_is_found(checked, was, believed, words):
    report = checked(
        "recorder", served=LOCKSTEP, believed={was: believed}, options={"rate_hz": 200.0}
    )
    assert words in findings_of(report)
    assert "map.drive.servo.ring" in findings_of(report)


def test_a_rig_file_with_which_no_run_would_begin_is_found(checked):
    assert (
        "rig: plant.heartbeat_s: found 0.5, expected more than 3.05 s, for which one lost reply"
        in findings_of(checked("real_time"))
    )
    assert "heartbeat_s" not in findings_of(checked("real_time", watchdog_s=1.0))


def test_nothing_is_written_to_a_real_rig(checked):
    functions = set()

    def note(device, function, written):
        functions.add((function, written is not None))

    checked("real_time", fault=note)
    assert functions == {(3, False)}


@pytest.mark.parametrize(
    ("was", "believed", "words"),
    [
        (
            ANGLE,
            ANGLE.replace("scale", 'word_order = "little", scale'),
            [
                "angle reads",
                'with word_order = "big" it would be',
                "correct map.drive.servo.read.angle",
            ],
        ),
        (
            FORCE_Y,
            FORCE_Y.replace("unit", 'word_order = "little", unit'),
            [
                "force_y reads",
                'with word_order = "big" it would be',
                "correct map.sensor.force.read.force_y",
            ],
        ),
        (
            FORCE_Y,
            FORCE_Y.replace("float32", "int32"),
            ["force_y reads", 'with type = "float32" it would be'],
        ),
        (
            TIME,
            TIME.replace('"us"', '"ms"'),
            [
                "its clock goes on by 1000 s in each second by its counter",
                'with unit = "us" the two agree',
            ],
        ),
        (
            VELOCITY,
            VELOCITY.replace("1e-5", "-1e-5"),
            [
                "velocity is -",
                "change the sign of map.drive.servo.read.velocity.scale",
            ],
        ),
        (
            VELOCITY,
            VELOCITY.replace('"rad/s"', '"deg/s"'),
            ["velocity is 0.01", "times the rate of change", 'with unit = "rad/s" the two agree'],
        ),
        (
            TEMPERATURE,
            TEMPERATURE.replace("0.1", "10.0"),
            ["temperature reads 2400 °C, expected -20 to 150 °C"],
        ),
        (
            FORCE_Y,
            FORCE_Y.replace("unit", "offset = 60.0, unit"),
            [
                "force_y is 6",
                "N with nobody in the machine, expected within ±20 N",
                "tare the sensor",
            ],
        ),
    ],
    ids=[
        "word order",
        "word order of a float",
        "type",
        "unit of time",
        "sign",
        "unit of velocity",
        "hot",
        "offset",
    ],
)
def test_a_register_described_wrongly_is_found_by_what_it_reads(checked, was, believed, words):
    findings = findings_of(checked(believed={was: believed}))
    assert [word for word in words if word not in findings] == [], findings


def test_degrees_taken_for_radians_are_found_by_the_limits(checked):
    in_degrees = ANGLE.replace("1e-6", "1e-4").replace('"rad"', '"deg"')
    findings = findings_of(
        checked(
            served={ANGLE: in_degrees}, believed={in_degrees: in_degrees.replace('"deg"', '"rad"')}
        )
    )
    assert "outside its limits -0.35 to 1.75 rad" in findings
    assert 'with unit = "deg" it would be' in findings


def test_swapped_bytes_are_distinguished_from_swapped_words(checked, monkeypatch):
    put = Device._put

    def swapped(self, block, values):
        put(self, block, values)
        if isinstance(self, Sensor):
            start = block.address - self.first
            words = self.registers[start : start + block.count]
            self.registers[start : start + block.count] = [
                (w >> 8) | ((w & 0xFF) << 8) for w in words
            ]

    monkeypatch.setattr(Device, "_put", swapped)
    report = checked()
    about_force = [str(finding) for finding in report.findings if "force_y" in finding.quantity]
    assert len(about_force) == 4
    assert all(
        "with the two bytes of each register swapped it would be" in finding
        for finding in about_force
    )
    assert not [finding for finding in report.findings if finding.device.startswith("drive")]


def test_a_counter_that_stands_still_is_found(checked, altered):
    altered(lambda device, values: values.update(sequence=7.0))
    assert "drive hip: its counter goes up by 0 a second, from 7 to 7, expected" in findings_of(
        checked("real_time")
    )


def test_registers_that_are_not_latched_with_the_counter_are_found(checked, altered):
    asked = iter(range(10**9))
    altered(
        lambda device, values: "angle" in values and values.update(angle=0.1 + 1e-5 * next(asked))
    )
    assert "angle changed while the sample counter did not" in findings_of(checked("real_time"))


def test_a_rate_that_the_devices_do_not_have_is_found(checked):
    findings = findings_of(checked("real_time", options={"rate_hz": 80.0}))
    assert (
        "drive hip: its counter goes up by 4" in findings
        or "drive hip: its counter goes up by 3" in findings
    )
    assert ", expected 80; is it sampling?" in findings


def test_a_slow_device_and_a_slow_line_are_found(checked):
    def slow(device, function, written):
        if device.unit == 13:
            time.sleep(0.06)

    # At half the rate, so that a busy computer does not make the drives too slow as well.
    findings = findings_of(checked("real_time", fault=slow, options={"rate_hz": 20.0}))
    assert "sensor shank_front: takes" in findings
    assert "ms to answer, too long for a sample of 20 Hz (50 ms)" in findings
    assert "rig: all devices can be asked" in findings
    assert "raise `every` of the sensors" in findings


EVERY = 'map = "force"\n'


@pytest.mark.parametrize("shipped", ["plain", "real_time"])
def test_sensors_that_are_hardly_ever_due_are_checked_by_the_readings_alone(checked, shipped):
    report = checked(shipped, served={EVERY: f"{EVERY}every = 1000\n"})
    assert [finding for finding in report.findings if finding.device.startswith("sensor")] == []
    seldom = (
        "rig: sensor[0].every: found 1000, which is 25 s at 40 Hz; expected a force at least every"
        " 10 s"
    )
    assert (seldom in findings_of(report)) == (shipped == "real_time")


def test_a_sensor_that_would_be_read_less_often_than_any_watchdog_waits_is_refused(rig_file):
    with pytest.raises(SettingsError, match=r"sensor\[0\]\.every: found 100000, expected .*1000"):
        load_rig(rig_file(replace={EVERY: f"{EVERY}every = 100000\n"}))


@pytest.mark.parametrize("shipped", ["plain", "real_time"])
def test_an_absent_device_is_reported_and_the_others_are_checked(checked, shipped):
    believed = {'unit = 12\nmap = "force"': 'unit = 99\nmap = "force"'}
    report = checked(shipped, believed=believed)
    (absent,) = unrelated_to_speed(report)
    assert absent.startswith("sensor thigh_back")
    assert [device.latency is not None for device in report.devices] == [
        True,
        True,
        True,
        False,
        True,
        True,
    ]


def test_a_rig_that_is_off_is_reported_to_refuse_connections(rig_file):
    report = check_rig(rig_file("real_time", 1))
    assert len(report.findings) == 6
    assert "refuses the connection; check that the rig is on" in findings_of(report)


def test_lines_that_do_not_come_about_are_waited_for_at_once_and_not_one_after_the_other(rig_file):
    """Six TLS lines to ports that take connections and say nothing."""
    with ExitStack() as stack:
        ports = [
            stack.enter_context(socket.create_server(("127.0.0.1", 0))).getsockname()[1]
            for _ in range(6)
        ]
        rig, number = rig_file("real_time", connect_s=1.0), iter(range(6))
        text = re.sub(
            r"^(map = .*)$",
            lambda m: f'{m[1]}\nline = "l{next(number)}"',
            rig.read_text(),
            flags=re.M,
        )
        lines = (f'[line.l{k}]\ntransport = "tls"\nport = {port}\n' for k, port in enumerate(ports))
        rig.write_text(text + "".join(lines))
        began = time.monotonic()
        report = check_rig(rig)
        took = time.monotonic() - began
    assert [
        str(finding).partition(":")[2].count("no TLS connection") for finding in report.findings
    ] == [1] * 6
    assert took < 8.0, "one line takes two seconds, one after the other they would take 12"


def test_a_line_that_is_lost_while_its_devices_are_read_is_reported_once(checked, monkeypatch):
    async def lost(probe, report, earlier):
        raise DeviceError(
            "line leg (127.0.0.1:802): the line is lost, and with it hip drive, knee drive"
        )

    monkeypatch.setattr(survey, "_measure_device", lost)
    assert (
        findings_of(checked())
        == "rig: line leg (127.0.0.1:802): the line is lost, and with it hip drive, knee drive"
    )


def test_another_device_is_detected_by_its_identity_and_not_checked_further(checked):
    report = checked(believed={"value = 0x4653": "value = 0x4654"})
    assert len(report.findings) == 4
    assert "identity register 0 holds 0x4653, expected 0x4654" in findings_of(report)


def test_a_sensor_that_is_frozen_is_found(checked, altered):
    altered(
        lambda device, values: (
            "force_x" in values and values.update(force_x=1.0, force_y=2.0, force_z=3.0)
        )
    )
    assert "all three forces are constant (1, 2, 3 N)" in findings_of(checked())


def test_a_fault_and_a_current_at_rest_are_found(checked, altered):
    altered(lambda device, values: "status" in values and values.update(status=8.0, current=9.0))
    findings = findings_of(checked())
    assert "reports a fault (status 0x0008, fault bits 0x0008)" in findings
    assert "current reads 9 A, expected less than" in findings

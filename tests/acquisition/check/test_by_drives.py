"""A small movement by the drives shows whether set-point, angle, torque and velocity agree."""

import tempfile

import pytest

from pipelines.acquisition.check import by_drives
from pipelines.errors import DeviceError

READ = 'angle = { address = 104, type = "int32", scale = 1e-6, unit = "rad" }'
ENABLE = "enable = 0x000F"
WRITE = 'reference = { address = 200, type = "int32", scale = 1e-6, unit = "rad" }'
CURRENT = 'current = { address = 108, type = "int32", scale = 0.1, unit = "mA" }'
VELOCITY = 'velocity = { address = 106, type = "int32", scale = 1e-5, unit = "rad/s" }'
MOVE = {"move": True}


@pytest.fixture(autouse=True)
def _short(monkeypatch):
    monkeypatch.setattr(by_drives, "PERIOD_S", 2.0)


def findings_of(report):
    return "\n".join(map(str, report.findings))


def test_a_right_rig_answers_its_set_points(checked):
    report = checked(options=MOVE, rest_rad="[0.0, 0.0]")
    assert findings_of(report) == ""
    assert [answer.joint for answer in report.moved] == ["hip", "knee"]
    for answer in report.moved:
        assert answer.gain == pytest.approx(1.0, abs=by_drives.GAIN)
        assert 0 <= answer.delay_s < 0.1
        assert answer.torque_with_speed > by_drives.LEAST_CORRELATION


@pytest.mark.parametrize(
    ("there", "believed", "words"),
    [
        (
            {READ: READ.replace("1e-6", "-1e-6"), VELOCITY: VELOCITY.replace("1e-5", "-1e-5")},
            {READ: READ, VELOCITY: VELOCITY},
            "its angle goes against its set-point",
        ),
        ({}, {CURRENT: CURRENT.replace("0.1", "-0.1")}, "its torque goes against its speed"),
        (
            {},
            {WRITE: WRITE.replace("1e-6", "2e-6"), ENABLE: f"own_scale = true\n{ENABLE}"},
            "times as far as its set-point: unit or scale of",
        ),
    ],
    ids=["sign of the angle", "sign of the current", "scale of the set-point"],
)
def test_a_wrong_sign_or_scale_shows_in_the_answer(checked, there, believed, words):
    report = checked(options=MOVE, served=there, believed=believed, rest_rad="[0.0, 0.0]")
    assert [finding.device for finding in report.findings if words in finding.text] == [
        "drive hip",
        "drive knee",
    ], findings_of(report)


def test_a_set_point_of_another_sign_than_its_angle_is_reported_and_nothing_is_moved(checked):
    report = checked(options=MOVE, believed={WRITE: WRITE.replace("1e-6", "-1e-6")})
    assert (
        "map.drive.servo.write.reference.scale: found -1e-06 with 1e-06 of read.angle"
        in findings_of(report)
    )
    assert report.moved == []


@pytest.mark.parametrize("scale", ["-1e-5", "3e-5"])
def test_a_velocity_of_the_wrong_sign_or_scale_stops_the_movement(checked, scale):
    report = checked(
        options=MOVE, believed={VELOCITY: VELOCITY.replace("1e-5", scale)}, rest_rad="[0.0, 0.0]"
    )
    assert "rig: the guided movement was stopped: " in findings_of(report)
    assert "velocity" in findings_of(report)


def test_a_set_point_in_the_wrong_unit_is_stopped_before_the_leg_goes_far(checked):
    believed = {WRITE: WRITE.replace('"rad"', '"deg"'), ENABLE: f"own_scale = true\n{ENABLE}"}
    report = checked(options=MOVE, believed=believed, rest_rad="[0.0, 0.0]")
    assert "rig: the guided movement was stopped: " in findings_of(report)


def test_devices_on_one_line_are_moved_like_others(checked):
    report = checked(options=MOVE, on_a_line=True, rest_rad="[0.0, 0.0]")
    assert findings_of(report) == ""
    assert [answer.joint for answer in report.moved] == ["hip", "knee"]


def test_a_leg_away_from_zero_is_not_moved_before_its_signs_are_known(checked):
    report = checked(options=MOVE, rest_rad="[0.3, -0.6]", coulomb_nm="[40.0, 40.0]")
    assert "as a drive of wrong sign leaps" in findings_of(report)
    assert (report.moved, len(report.devices)) == ([], 6)  # the report so far is kept


def test_a_movement_that_the_rigs_limits_do_not_allow_is_reported_with_the_rest_and_leaves_no_files(
    checked, tmp_path, monkeypatch
):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    report = checked(options=MOVE, rest_rad="[0.0, 0.0]", served={"[-0.35, 1.75]": "[-0.02, 1.75]"})
    assert "rig: " in findings_of(report) and "rad" in findings_of(report)
    assert len(report.devices) == 6
    assert not list(tmp_path.glob("exoid-check-*"))


@pytest.mark.parametrize("named", [False, True], ids=["before the recording", "with samples"])
def test_a_movement_that_is_stopped_leaves_only_what_the_message_names(
    checked, tmp_path, monkeypatch, named
):
    def stopped(rig_file, settings, excitation, output, *given, **named_too):
        raise DeviceError(
            "hip drive: no answer; the leg was"
            f" stopped{f', samples are in {output}' if named else ''}"
        )

    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(by_drives, "acquire", stopped)
    report = checked(options=MOVE, rest_rad="[0.0, 0.0]")
    assert "rig: the guided movement was stopped: hip drive: no answer" in findings_of(report)
    assert bool(list(tmp_path.glob("exoid-check-*"))) is named


def test_nothing_is_moved_where_something_is_wrong(checked):
    controls = []

    def note(device, function, written):
        if written:
            controls.append(written[-1])

    report = checked(
        options=MOVE,
        believed={"value = 0x4653": "value = 0x4654"},
        fault=note,
        rest_rad="[0.0, 0.0]",
    )
    assert report.findings and not report.moved
    assert set(controls) <= {0}

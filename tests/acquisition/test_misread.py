"""What a device's values show to be misread is named, and right ones are not: by the check, and in
the recording."""

import re
import tomllib

import numpy as np
import pytest

from pipelines.acquisition.check.check import check_rig
from pipelines.acquisition.record_only import misread_values, record_only
from pipelines.contracts import RECORDING
from pipelines.errors import DeviceError, SettingsError
from pipelines.modbus.register_block import Block
from pipelines.settings.acquire import RunSettings
from pipelines.settings.rig import Register
from tests.acquisition.bench import BENCH, ELBOW, RECORDING_ONLY, TURNING
from tests.acquisition.simulated_device import SimulatedDevice

SWING = RECORDING_ONLY.replace(
    "{registers}",
    '{counter}{angle}{velocity}torque = {{ address = {torque}, type = "int16", unit = "N·m" }}',
).replace("{watchdog_s}", "0.6")
LONG = 'address = {}, type = "int32", word_order = "{}", scale = {}'


def swings(torn=False):
    """Serve counter, angle and velocity in thousandths of a degree, low words first."""

    def at(k):
        angle = 66.0 + 20.0 * np.sin(6.0 * k / 100.0)
        return round(1e3 * angle), round(1e3 * 120.0 * np.cos(6.0 * k / 100.0))

    def answer(n, words):
        k = words[0]
        (angle, velocity), (before, _) = at(k), at(k - 1)
        high = (before if torn else angle) >> 16
        long = [angle & 0xFFFF, high & 0xFFFF, velocity & 0xFFFF, velocity >> 16 & 0xFFFF]
        return [k & 0xFFFF, *long, 20, 0, 0]

    return SimulatedDevice(answer)


@pytest.fixture
def swinging(tmp_path):
    """Return a rig file of a device that swings, and its server."""

    def write(torn=False, by=0, order="little", scale=1e-3, counter=True, has_velocity=True):
        server = swings(torn)
        path = tmp_path / "swing.toml"
        text = SWING.format(
            port=server.port,
            counter='sequence = { address = 0, type = "uint16" }\n' if counter else "",
            angle=f'angle = {{ {LONG.format(1 + by, order, scale)}, unit = "deg" }}\n',
            velocity=f'velocity = {{ {LONG.format(3 + by, order, 1e-3)}, unit = "deg/s" }}\n'
            if has_velocity
            else "",
            torque=5 + by,
        )
        path.write_text(text)
        return path, server

    return write


def findings_of(path, server):
    with server:
        return [finding.text for finding in check_rig(path, 100.0).findings]


def test_a_right_map_of_a_machine_that_moves_has_no_findings(swinging):
    assert findings_of(*swinging()) == []


def test_words_in_the_wrong_order_are_named_though_no_limits_are_known(swinging):
    for counter in (True, False):
        (text,) = findings_of(*swinging(order="big", has_velocity=False, counter=counter))
        assert 'with word_order = "little" by' in text
        assert "correct map.drive.plc.read.angle, or its address" in text


def test_a_map_without_a_counter_that_is_one_address_off_is_named_by_its_velocity(swinging):
    (text,) = findings_of(*swinging(by=1, counter=False))
    assert "all of map.drive.plc.read is one address too high: subtract 1 from each" in text
    assert "write may be" not in text


def test_an_angle_of_another_scale_is_found_by_its_velocity(swinging):
    (text,) = findings_of(*swinging(scale=1e-4))
    assert text.endswith(
        "correct the scale of map.drive.plc.read.angle or map.drive.plc.read.velocity, by a factor"
        " of 10"
    )


def test_words_of_two_samples_are_named_and_never_recorded(swinging, tmp_path):
    (text,) = findings_of(*swinging(torn=True))
    assert "angle leaps by 65536 counts and back" in text
    path, server = swinging(torn=True)
    output = tmp_path / "swing.parquet"
    settings = RunSettings(name="one", run="exo_alone", purpose="train", duration_s=2.0)
    with server:
        record_only(path, settings, output, 100.0, ELBOW)
    table = RECORDING.read(output)
    angle = np.degrees(table.frame["elbow_angle_rad"])
    assert 45.9 < angle.min() < angle.max() < 86.1
    assert table.metadata["reading"]["torn_rows"] > 0


def test_an_angle_that_no_recording_holds_ends_the_run_with_its_value(swinging, tmp_path):
    path, server = swinging(order="big")
    settings = RunSettings(name="one", run="exo_alone", purpose="train", duration_s=1.0)
    with server, pytest.raises(DeviceError, match=r"its angle is \S+ rad, and a recording holds"):
        record_only(path, settings, tmp_path / "swing.parquet", 100.0, ELBOW)


def a_turntable():
    """Serve a counter, and an angle in tenths of a degree that turns by 14 rad/s, from 0 again."""

    def answer(n, words):
        return [words[0], words[0] * 80 % 3600, 20]

    return SimulatedDevice(answer)


@pytest.fixture
def turntable(tmp_path):
    def write(wraps_at=""):
        server = a_turntable()
        path = tmp_path / "turntable.toml"
        text = BENCH.format(port=server.port, watchdog_s=1.0)
        wrong = 'scale = 1e-3, unit = "rad"'
        assert wrong in text
        path.write_text(text.replace(wrong, f'scale = 0.1, unit = "deg"{wraps_at}'))
        return path, server

    return write


def test_the_turns_of_a_joint_without_end_are_counted(turntable, tmp_path):
    path, server = turntable(", wraps_at = 3600")
    output = tmp_path / "turntable.parquet"
    settings = RunSettings(name="one", run="exo_alone", purpose="train", duration_s=2.5)
    with server:
        with pytest.raises(SettingsError, match=r"set turns = true at that joint"):
            record_only(path, settings, output, 100.0, ELBOW)
        record_only(path, settings, output, 100.0, TURNING)
    frame = RECORDING.read(output).frame
    turned = np.radians(8.0) * (frame["sequence"] - frame["sequence"].iloc[0])
    assert turned.iloc[-1] > 4.0 * np.pi, "more than a recording of another joint holds"
    angle = frame["elbow_angle_rad"]
    assert np.allclose(angle - angle.iloc[0], turned, atol=1e-6)


def test_an_angle_that_starts_again_is_never_recorded_as_a_leap(turntable, tmp_path):
    path, server = turntable()
    settings = RunSettings(name="one", run="exo_alone", purpose="train", duration_s=3.0)
    with server, pytest.raises(DeviceError, match=r"elbow_angle_rad leaps .*wraps_at"):
        record_only(path, settings, tmp_path / "turntable.parquet", 100.0, ELBOW)
    assert not (tmp_path / "turntable.parquet").exists()


def test_the_check_names_the_count_at_which_an_angle_starts_again(turntable):
    (text,) = findings_of(*turntable())
    assert "angle leaps by 3600 counts" in text
    assert "set map.drive.plc.read.angle.wraps_at = 3600, and turns = true" in text
    assert findings_of(*turntable(", wraps_at = 3600")) == []


@pytest.mark.parametrize(
    ("kind", "negative", "expected"),
    [
        ("uint16", lambda m: 65536 - m, 'set map.drive.plc.read.torque.type = "int16"'),
        ("uint16", lambda m: 32768 + m, "a magnitude with a sign bit"),
        ("int16", lambda m: 32768 + m, "a magnitude with a sign bit"),
        ("int16", lambda m: 65536 - m, ""),
    ],
)
def test_a_sign_that_is_misread_is_named(tmp_path, kind, negative, expected):
    def answer(n, words):
        torque = round(200.0 * np.sin(0.2 * words[0] + 0.1))
        return [words[0], 500, torque if torque >= 0 else negative(-torque)]

    server = SimulatedDevice(answer)
    path = tmp_path / "bench.toml"
    text = BENCH.format(port=server.port, watchdog_s=1.0)
    was = 'torque = { address = 2, type = "int16"'
    assert was in text
    path.write_text(text.replace(was, was.replace("int16", kind)))
    texts = findings_of(path, server)
    assert len(texts) == bool(expected)
    assert all(expected in one and "torque: leaps by" in one for one in texts)


@pytest.fixture
def record_and_check(tmp_path):
    """Record and check a device; return the recording, and what both say of its values."""

    def run(answer, was="", now="", seconds=1.0, kind="exo_alone"):
        server = SimulatedDevice(answer)
        path, output = tmp_path / "bench.toml", tmp_path / "bench.parquet"
        text = BENCH.format(port=server.port, watchdog_s=1.0)
        assert was in text
        path.write_text(text.replace(was, now) if was else text)
        output.unlink(missing_ok=True)
        settings = RunSettings(name="one", run=kind, purpose="train", duration_s=seconds)
        with server:
            record_only(path, settings, output, 100.0, ELBOW)
            return output, misread_values(output, path), findings_of(path, server)

    return run


@pytest.mark.parametrize(
    ("keys", "middle", "expected"),
    [
        ('type = "uint16"', 0, 'read as large ones; set {}.type = "int16"'),
        ('type = "int16"', 32768, '{}.type = "uint16" and offset = -32768'),
        ('type = "uint16"', 32768, "if it stands for 0, set {}.offset = -32768"),
        ('type = "int16"', 0, ""),
        ('type = "uint16", offset = -32768', 32768, ""),
    ],
)
def test_a_torque_that_counts_from_another_zero_is_named(record_and_check, keys, middle, expected):
    """By the check and in the recording, which may be the first to see it change its sign."""

    def answer(n, words):
        torque = round(200.0 * np.sin(0.2 * words[0] + 0.1))
        return [words[0], 500, (torque + middle) & 0xFFFF]

    was = 'address = 2, type = "int16", scale = 0.1'
    _, warnings, findings = record_and_check(answer, was, f"address = 2, {keys}")
    texts = warnings + findings
    assert len(texts) == 2 * bool(expected)
    assert all(expected.format("map.drive.plc.read.torque") in text for text in texts)


def test_a_torque_of_magnitude_and_sign_bit_is_recorded_and_has_no_findings(tmp_path):
    def answer(n, words):
        torque = round(200.0 * np.sin(0.2 * words[0] + 0.1))
        return [words[0], 500, torque if torque >= 0 else 32768 - torque]

    path, output = tmp_path / "bench.toml", tmp_path / "bench.parquet"
    for act in ("check", "record"):
        server = SimulatedDevice(answer)
        text = BENCH.format(port=server.port, watchdog_s=1.0)
        was = 'torque = { address = 2, type = "int16"'
        path.write_text(text.replace(was, f"{was.replace('int16', 'uint16')}, sign_bit = 15"))
        if act == "check":
            assert findings_of(path, server) == []
            continue
        settings = RunSettings(name="one", run="exo_alone", purpose="train", duration_s=0.8)
        with server:
            record_only(path, settings, output, 100.0, ELBOW)
    torque = RECORDING.read(output).frame["elbow_torque_nm"]
    assert -20.0 <= torque.min() < -15.0 and 15.0 < torque.max() <= 20.0


@pytest.mark.parametrize("every", [1, 5], ids=["each sample", "each fifth sample"])
def test_registers_that_are_renewed_slower_than_rows_come_are_named(record_and_check, every):
    def answer(n, words):
        at = words[0] // every * every / 100.0
        return [words[0], round(800.0 * np.sin(6.0 * at)) & 0xFFFF, 20]

    output, texts, findings = record_and_check(answer, seconds=1.2)
    assert len(texts) == len(findings) == (every > 1), "the torque rests"
    for text, start in zip(
        (*texts, *findings), (f"{output}: elbow_angle_rad", "angle"), strict=False
    ):
        rate = re.match(re.escape(start) + r": new values come at ([\d.]+) Hz, and rows at", text)
        assert rate is not None and 18.0 < float(rate[1]) < 22.0


@pytest.mark.parametrize("largest", [20000.0, 50000.0], ids=["within", "beyond"])
def test_a_torque_that_is_cut_off_at_the_end_of_its_register_is_named(record_and_check, largest):
    def answer(n, words):
        torque = round(largest * np.sin(0.1 * words[0]))
        return [words[0], 500, min(max(torque, -32768), 32767) & 0xFFFF]

    _, texts, findings = record_and_check(answer)
    assert len(texts) == len(findings) == (largest > 32768.0)
    for text, name in zip((*texts, *findings), ("elbow_torque_nm", "torque"), strict=False):
        assert re.search(rf"{name}: \d+ of \d+ values are at the end of their register", text)


@pytest.mark.parametrize("most", [27648, 16000], ids=["beyond", "within"])
def test_a_torque_that_is_cut_off_within_its_register_is_named(record_and_check, most):
    """An analog input ends at 27648 counts, far from the end of its 16 bits."""

    def answer(n, words):
        torque = round(1.5 * most * np.sin(0.1 * words[0]))
        return [words[0], 500, min(max(torque, -27648), 27648) & 0xFFFF]

    _, texts, findings = record_and_check(answer, seconds=2.0)
    assert len(texts) == len(findings) == (most == 27648)
    assert all("at full slope and stay there" in text for text in (*texts, *findings))


@pytest.mark.parametrize("code", [None, -9999, 0])
def test_a_code_for_missing_readings_is_named(record_and_check, code):
    """A raw 0 is that of a drive that is off."""

    def answer(n, words):
        swing = 500 + 100 * np.sin(0.06 * words[0])
        torque = code if code is not None and words[0] % 50 == 0 else round(swing)
        return [words[0], round(700.0 * np.sin(0.06 * words[0])) & 0xFFFF, torque & 0xFFFF]

    _, texts, findings = record_and_check(answer, seconds=4.0, kind="with_human")
    for said in (texts, findings):
        assert ["often exactly -999.9 (a raw -9999)" in text for text in said] == [True] * (
            code == -9999
        )


@pytest.mark.parametrize("ticks_hz", [1000.0, 1024.0])
def test_a_clock_that_is_hardly_too_fast_is_named(record_and_check, ticks_hz):
    """Ticks of 1/1024 s pass for milliseconds, and rates may differ by 5 % from row to row."""

    def answer(n, words):
        ticks = round(words[0] * ticks_hz / 100.0)
        angle = round(700.0 * np.sin(0.06 * words[0])) & 0xFFFF
        return [words[0], angle, 20, ticks >> 16, ticks & 0xFFFF]

    was = "angle = {"
    clock = 'time = { address = 3, type = "uint32", unit = "ms" }\n'
    output, texts, findings = record_and_check(answer, was, clock + was, seconds=10.0)
    rate = RECORDING.read(output).metadata["reading"]["clock_rate"]
    assert rate == pytest.approx(ticks_hz / 1000.0, abs=2e-3)
    is_named = ticks_hz != 1000.0
    assert ["read.time with the manual: scale = 0.97" in text for text in texts] == [
        True
    ] * is_named
    assert ["read.time with the manual: scale = 0.97" in text for text in findings] == [
        True
    ] * is_named


@pytest.mark.parametrize("run", ["exo_alone", "with_human"])
@pytest.mark.parametrize("scale", [0.1, -0.1])
def test_a_torque_of_the_wrong_sign_is_named_where_nobody_is_in_the_machine(tmp_path, run, scale):
    """Friction consumes what a drive delivers; a person may drive the machine."""

    def answer(n, words):
        phase = 0.1 * words[0]
        torque = round(200.0 * np.cos(phase) - 300.0 * np.sin(phase))
        return [words[0], round(700.0 * np.sin(phase)) & 0xFFFF, torque & 0xFFFF]

    server = SimulatedDevice(answer)
    path, output = tmp_path / "bench.toml", tmp_path / "bench.parquet"
    text = BENCH.format(port=server.port, watchdog_s=1.0)
    path.write_text(text.replace("scale = 0.1", f"scale = {scale}"))
    settings = RunSettings(name="one", run=run, purpose="train", duration_s=2.0)
    with server:
        record_only(path, settings, output, 100.0, ELBOW)
    texts = misread_values(output, path)
    assert len(texts) == (run == "exo_alone" and scale < 0.0)
    assert all("the drives absorb" in text for text in texts)


ENCODED = {
    "mod10": ('type = "uint32", encoding = "mod10"', 'type = "uint32"'),
    "mod10, a sign each word": ('type = "int32", encoding = "mod10"', 'type = "int32"'),
    "bcd": ('type = "uint32", encoding = "bcd", sign_bit = 31', 'type = "int32"'),
    "direction": ('type = "uint32", direction = { address = 4, negative = 1 }', 'type = "uint32"'),
}
"""Keys of a torque as a device encodes it, and as a hurried user writes them."""
NAMED = {
    "mod10": 'encoding = "mod10"',
    "mod10, a sign each word": 'encoding = "mod10"',
    "bcd": 'encoding = "bcd" and type = "uint32" and sign_bit = 31',
    "direction": "direction to the register that has it, or sign_bit",
}
"""What the check says then."""


@pytest.mark.parametrize("encoded", ENCODED)
def test_an_encoding_is_recorded_as_the_file_says_and_named_where_it_does_not(
    record_and_check, encoded
):
    right, wrong = (f'address = 2, {keys}, unit = "N·m"' for keys in ENCODED[encoded])
    device = Block({"torque": Register.model_validate(tomllib.loads(f"x = {{ {right} }}")["x"])})
    middle = 25000.0 if encoded == "mod10" else 0.0

    def answer(n, words):
        torque = middle + 24000.0 * np.sin(0.15 * words[0])
        return [words[0], 500, *device.encode({"torque": torque}), 0, 0][:5]

    was = 'address = 2, type = "int16", scale = 0.1, unit = "N·m"'
    for keys in (right, wrong):
        output, warnings, findings = record_and_check(answer, was, keys, seconds=1.2)
        texts = warnings + findings
        if keys == wrong:
            assert len(texts) == 2
            assert all(f"set map.drive.plc.read.torque.{NAMED[encoded]}" in text for text in texts)
            continue
        assert texts == []
        frame = RECORDING.read(output).frame
        # The rows' numbers begin with that of the device at the first row.
        phases = 0.15 * (frame["sequence"].to_numpy() + np.arange(10**4)[:, None])
        wrong_nm = middle + 24000.0 * np.sin(phases) - frame["elbow_torque_nm"].to_numpy()
        assert np.abs(wrong_nm).max(axis=1).min() <= 1.0

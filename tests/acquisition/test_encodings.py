"""Decimal digits are distinguished from binary values by more than chance."""

import numpy as np
import pytest

from pipelines.acquisition.encodings import (
    CHANCE,
    apart_word,
    decimal_keys,
    is_float16,
    is_gray,
    is_half_of_float64,
    is_low_byte,
)
from pipelines.acquisition.misread import leaping, misread
from pipelines.modbus.register_block import Block
from pipelines.settings.rig import Register

SWING = np.sin(0.06 * np.arange(300))


def read(counts, device, used):
    """Return the counts that a register map finds in a device of another encoding."""
    device, used = (Block({"x": Register(address=0, **keys)}) for keys in (device, used))
    return np.array([used.decode(device.encode({"x": count}))["x"] for count in counts])


MOD10 = {"encoding": "mod10"}
BCD = {"encoding": "bcd"}
WORD, LONG = {"type": "uint16"}, {"type": "uint32"}
SIGN, LONG_SIGN = {"sign_bit": 15}, {"sign_bit": 31}
SIGNED, LONG_SIGNED = {"type": "int16"}, {"type": "int32"}


@pytest.mark.parametrize(
    ("device", "used", "counts", "missing"),
    [
        (LONG | MOD10, LONG_SIGNED, 25000 * (1 + SWING), MOD10),
        (LONG_SIGNED | MOD10, LONG_SIGNED, 25000 * SWING, MOD10),
        (LONG | MOD10 | LONG_SIGN, LONG_SIGNED, 25000 * SWING, MOD10 | LONG | LONG_SIGN),
        (LONG | MOD10 | LONG_SIGN, LONG | LONG_SIGN, 25000 * SWING, MOD10),
        (WORD | BCD, WORD, 200 * (1 + SWING), BCD),
        (WORD | BCD, WORD, np.round(300 * (1 + SWING), -1), BCD),
        (WORD | BCD | SIGN, WORD | SIGN, 300 * SWING, BCD),
        (WORD | BCD | SIGN, SIGNED, 300 * SWING, BCD | WORD | SIGN),
        (LONG | BCD, LONG_SIGNED, 2e5 * (1 + SWING), BCD | LONG),
    ],
)
def test_digits_are_named_and_nothing_is_where_they_are_read_as_such(device, used, counts, missing):
    values = read(counts, device, used)
    assert decimal_keys(Register(address=0, **used), values) == missing
    assert decimal_keys(Register(address=0, **device), read(counts, device, device)) == {}


def test_the_magnitude_of_an_angle_is_named():
    """As of an inclinometer, whose tilt has no sign."""
    register = Register(address=0, type="int16", scale=0.01)
    angle = np.round(300 * SWING * np.cos(0.004 * np.arange(300)))
    (text,) = misread("angle", register, "x", register.scale * np.abs(angle))
    assert "set x.sign_bit" in text
    assert not list(misread("angle", register, "x", register.scale * angle))


@pytest.mark.parametrize("used", [LONG_SIGNED, LONG, LONG | MOD10, LONG_SIGNED | MOD10])
@pytest.mark.parametrize("parts", [60, 100, 1000])
def test_whole_degrees_and_their_parts_in_two_registers_are_no_number(used, parts):
    """As of an encoder's display; neither a binary number of two words nor a decimal one is."""
    degrees = 60 + 40 * SWING
    words = 65536 * np.floor(degrees).astype(int) + (degrees % 1.0 * parts).astype(int)
    register = Register(address=0, scale=0.25, **used)
    values = 0.25 * read(words, LONG, used)
    (text,) = misread("angle", register, "x", values)
    assert "the two registers are not one number" in text
    assert f"within {int((words % 65536).max())} counts" in text


@pytest.mark.parametrize("kind", [LONG_SIGNED, LONG_SIGNED | MOD10, LONG | LONG_SIGN])
@pytest.mark.parametrize("size", [3, 300, 3e4, 3e5, 3e6])
@pytest.mark.parametrize("steps", [1, 100, 2500, 10000, 16384, 65536])
def test_one_number_of_two_registers_is_not_taken_for_two(kind, size, steps):
    """Of any size, in steps that leave few low words; and that rests at whole numbers."""
    register = Register(address=0, **kind)
    noise = np.random.default_rng(0).normal(size=300)
    for counts in (size * SWING, size * np.sign(SWING) + noise, size * SWING + 1e5):
        values = np.round(counts / steps) * steps
        assert apart_word(register, values, decimal_keys(register, values)) is None


@pytest.mark.parametrize("bits", [8, 12, 16])
def test_a_gray_code_is_named_and_its_binary_values_are_not(bits):
    """As of an encoder on 16 inputs of a gateway; a joint that moves by a tenth of a turn."""
    register = Register(address=0, type="uint16", scale=0.5)
    counts = np.round(2**bits * (0.5 + 0.05 * SWING)).astype(int)
    (text,) = misread("angle", register, "angle", register.scale * (counts ^ counts >> 1))
    assert "as a Gray code" in text
    assert not is_gray(register, register.scale * counts)
    assert not is_gray(register, (register.scale * (counts ^ counts >> 1))[:30])


def test_binary_values_are_hardly_ever_taken_for_a_gray_code():
    registers, alarms = 1000, 0
    for seed in range(registers):
        rng = np.random.default_rng(seed)
        register = Register(address=0, type=str(rng.choice(["int16", "uint16", "int32", "uint32"])))
        low, high = register.counts
        size, middle = 10 ** rng.uniform(0.0, np.log10(high)), rng.uniform(-1.0, 1.0) * high
        # A joint that rests, with a count or two of noise, shows no code either.
        noise = rng.choice([0.5, 1.0, 0.01 * size]) * rng.normal(size=len(SWING))
        counts = size * rng.choice([0.0, 1.0]) * SWING + noise + rng.choice([0.0, middle])
        counts = np.clip(np.round(np.abs(counts) if low == 0 else counts), low, high)
        alarms += is_gray(register, counts[np.append(True, np.diff(counts) != 0.0)])
    assert alarms == 0


@pytest.mark.parametrize(("kind", "bit"), [("uint16", 15), ("uint32", 31)])
@pytest.mark.parametrize("quantity", ["angle", "torque"])
def test_a_sign_of_decimal_digits_that_the_file_does_not_have_is_named(kind, bit, quantity):
    signed = {"type": kind, "encoding": "bcd", "sign_bit": bit}
    unsigned = {"type": kind, "encoding": "bcd"}
    texts = list(
        misread(quantity, Register(address=0, **unsigned), "x", read(300 * SWING, signed, unsigned))
    )
    assert len(texts) == 1 and f"set x.sign_bit = {bit}" in texts[0]
    assert not list(
        misread(quantity, Register(address=0, **signed), "x", read(300 * SWING, signed, signed))
    )
    wide = read(150 * (1 + SWING), unsigned, unsigned)
    assert not [text for text in misread("angle", Register(address=0, **unsigned), "x", wide)]


def test_a_decimal_point_that_moves_is_named():
    """As of a panel meter that writes the digits of its display."""
    register = Register(address=0, type="int16", scale=0.01, unit="N·m")
    torque = 5.0 * SWING
    values = np.round(np.where(np.abs(torque) < 2.0, 10.0 * torque, torque), 2)
    (text,) = misread("torque", register, "torque", values)
    assert "values leap by a factor of ten" in text
    assert not list(misread("torque", register, "torque", np.round(torque, 2)))


@pytest.mark.parametrize("bits", [16, 32])
@pytest.mark.parametrize(
    ("device", "used", "named"),
    [
        ({"type": "uint", "sign_bit": -1}, {"type": "uint"}, "and sign_bit = {sign}"),
        ({"type": "uint", "sign_bit": -1}, {"type": "int"}, "and sign_bit = {sign}"),
        ({"type": "int"}, {"type": "uint"}, 'type = "int{bits}"'),
        ({"type": "int"}, {"type": "uint", "sign_bit": -1}, "and leave sign_bit out"),
        ({"type": "int"}, {"type": "int"}, ""),
    ],
)
def test_a_misread_sign_is_named_in_registers_of_any_length(device, used, named, bits):
    def keys_of(keys):
        sign = {"sign_bit": bits - 1} if "sign_bit" in keys else {}
        return {"type": f"{keys['type']}{bits}"} | sign

    device, used = keys_of(device), keys_of(used)
    values = read(np.round(1000 * SWING), device, used)
    texts = list(misread("torque", Register(address=0, **used), "x", values))
    assert len(texts) == bool(named)
    assert all(named.format(bits=bits, sign=bits - 1) in text for text in texts)


def test_a_direction_of_a_value_with_a_sign_of_its_own_is_named():
    true = np.round(1000 * SWING)
    register = Register(address=0, type="uint16", direction={"address": 1, "negative": 1})
    values = np.where(true < 0.0, -(true % 65536.0), true)
    (text,) = misread("torque", register, "x", values)
    assert 'set x.type = "int16" and leave direction out' in text


def test_too_few_values_show_nothing():
    values = read(30 * (1 + SWING), {"type": "uint16", **BCD}, {"type": "uint16"})
    assert decimal_keys(Register(address=0, type="uint16"), values[:30]) == {}


def test_binary_values_are_hardly_ever_taken_for_digits():
    alarms, registers, most_tried = 0, 1000, 5
    for seed in range(registers):
        rng = np.random.default_rng(seed)
        register = Register(address=0, type=str(rng.choice(["int16", "uint16", "int32", "uint32"])))
        low, high = register.counts
        size = 10 ** rng.uniform(1.0, np.log10(high))
        # Coarse steps leave low digits constant.
        step = 2.0 ** rng.integers(0, 12) * rng.choice([1, 3, 5, 10])
        counts = size * (SWING + 10 ** rng.uniform(-4.0, 0.0) * rng.normal(size=len(SWING)))
        counts = np.round((np.abs(counts) if low == 0 else counts) / step) * step
        alarms += bool(decimal_keys(register, np.clip(counts, low, high)))
    # Twice the probability that is allowed for each encoding that is tried.
    assert alarms <= 2 * CHANCE * most_tried * registers


def torques(friction=0.0, noise=0.0, gravity=10.0, channels=100):
    """Return torques of a machine that swings, with leaps of friction and with noise."""
    seconds = np.arange(300) / 100.0
    for seed in range(channels):
        rng = np.random.default_rng(seed)
        speed, *phases = rng.uniform([3.0, 0.0, 0.0, 0.0], [12.0, 6.0, 6.0, 6.0])
        torque = np.sin(speed * seconds + phases[0]) + 0.3 * np.sin(2.3 * speed * seconds)
        torque = gravity * torque + friction * np.sign(np.cos(speed * seconds + phases[2]))
        yield torque + rng.normal(0.0, noise, len(seconds))


@pytest.mark.parametrize("scale", [1.0, 0.05])
@pytest.mark.parametrize("friction", [0.0, 3.0])
def test_the_first_half_of_a_float64_is_named(friction, scale):
    """As a map of float32 reads a PLC's long reals."""
    single, double = ({"type": kind, "scale": scale} for kind in ("float32", "float64"))
    named = []
    for torque in torques(friction, noise=0.05):
        halves = [Block({"x": Register(address=0, **double)}).encode({"x": x})[:2] for x in torque]
        register = Register(address=0, **single)
        values = np.array([Block({"x": register}).decode(half)["x"] for half in halves])
        texts = list(misread("torque", register, "torque", values))
        named.append(any('set torque.type = "float64"' in text for text in texts))
    assert np.mean(named) > 0.7


@pytest.mark.parametrize("friction", [0.0, 0.3, 1.0, 3.0, 10.0])
@pytest.mark.parametrize("noise", [0.0, 0.05, 0.15])
@pytest.mark.parametrize("gravity", [0.0, 1.0, 10.0])
def test_a_float32_is_not_taken_for_half_of_a_float64(friction, noise, gravity):
    register = Register(address=0, type="float32")
    channels = torques(friction, noise * max(friction, 0.1), gravity)
    assert not any(is_half_of_float64(register, torque) for torque in channels)


SIGNED_WORD = Register(address=0, type="int16")


@pytest.mark.parametrize("used", [SIGNED, WORD, WORD | SIGN])
def test_a_float_of_16_bits_is_named(used):
    register = Register(address=0, **used)
    block, named = Block({"x": register}), []
    for torque in torques(noise=0.05):
        words = torque.astype(np.float16).view(np.uint16)
        values = np.array([block.decode([int(word)])["x"] for word in words])
        named.append(
            any(
                "no key reads a float16" in text
                for text in misread("torque", register, "x", values)
            )
        )
    assert np.mean(named) > 0.7


@pytest.mark.parametrize("used", [SIGNED, WORD])
@pytest.mark.parametrize("warms_up", [0.0, 0.005])
def test_two_bytes_of_two_quantities_in_a_register_are_named(warms_up, used):
    """As a temperature and a torque of 8 bits share one."""
    register = Register(address=0, **used)
    block, named = Block({"x": register}), []
    for torque in torques(friction=1.0, noise=0.05):
        low = np.round(8 * torque).astype(np.int8).view(np.uint8).astype(int)
        high = (31 + warms_up * np.arange(len(low))).astype(int)
        values = np.array(
            [block.decode([256 * h + b])["x"] for h, b in zip(high, low, strict=True)]
        )
        texts = misread("torque", register, "x", values)
        named.append(any("no key reads a byte" in text for text in texts))
    # Where zero is hardly passed, a high byte that changes weighs as much.
    assert np.mean(named) > 0.7


def test_an_angle_of_8_bits_that_starts_again_is_not_taken_for_two_bytes():
    register = Register(address=0, type="uint16")
    angle = np.round(50 * SWING) % 256
    assert not any("byte" in text for text in misread("angle", register, "x", angle))


@pytest.mark.parametrize("friction", [0.0, 1.0, 10.0])
@pytest.mark.parametrize("noise", [0.0, 0.05, 1.0])
@pytest.mark.parametrize("per_count", [0.5, 0.05, 0.01, 0.003])
def test_an_integer_is_not_taken_for_a_float_or_for_two_bytes(friction, noise, per_count):
    for level, gravity in ((0.0, 10.0), (0.0, 0.5), (64.0, 10.0), (3.7, 1.0)):
        for torque in torques(friction, noise, gravity):
            counts = np.clip(np.round((torque + level) / per_count), -32768, 32767)
            new = counts[np.flatnonzero(np.diff(counts, prepend=np.nan))]
            assert not is_float16(SIGNED_WORD, new)
            assert not is_low_byte(SIGNED_WORD, new)


@pytest.mark.parametrize("kind", ["int32", "uint32"])
def test_a_number_of_24_bits_without_its_sign_in_a_register_of_32_is_named(kind):
    """As of a 24-bit converter; a true value of 32 bits may be as large."""
    true = np.round(2e5 * SWING)
    register = Register(address=0, type=kind, scale=2e-5)
    (text,) = misread("torque", register, "x", 2e-5 * (true % 2.0**24))
    assert "negative values of 24 bits are read as large ones" in text
    signed = Register(address=0, type="int32", scale=2e-5)
    assert not list(misread("torque", signed, "x", 2e-5 * true))


def test_an_angle_that_leaps_after_old_values_is_named():
    time_s = 0.02 * np.arange(len(SWING))
    assert not list(leaping(time_s, SWING))
    held = np.where((time_s > 2.0) & (time_s < 3.0), SWING[100], SWING)
    (text,) = leaping(time_s, held)
    assert "as no mass can" in text
    # It leaps from the last value that is known, too.
    (text,) = leaping(time_s, np.where((time_s > 2.97) & (time_s < 3.0), np.nan, held))
    assert "as no mass can" in text and "nan" not in text
    # Steps of a coarse reading, and of a joint that is moved from stop to stop, are none.
    assert not list(leaping(time_s, np.round(5.0 * SWING) / 5.0))
    assert not list(leaping(time_s, np.where(time_s > 3.0, 1.0, 1e-4 * SWING)))

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from pydantic import ValidationError

from pipelines.modbus.register_block import Block
from pipelines.settings.rig import Register
from pipelines.settings.rig.block import check_counter
from pipelines.settings.rig.register import REGISTERS, STRUCT_CODES
from pipelines.settings.rig.register_map import SensorMap

patient = settings(deadline=None)  # a busy computer is no fault of a block's
ENDS = {
    "int16": (1, -32768, 32767),
    "uint16": (1, 0, 65535),
    "int32": (2, -2147483648, 2147483647),
    "uint32": (2, 0, 4294967295),
    "int64": (4, -9223372036854775808, 9223372036854775807),
    "uint64": (4, 0, 18446744073709551615),
}
"""Registers, and least and greatest count, of each integer."""
INTEGERS = [name for name in REGISTERS if not name.startswith("float")]


def test_each_integer_has_the_size_and_the_ends_of_its_name():
    registers = {kind: Register(address=0, type=kind) for kind in INTEGERS}
    assert {kind: (one.registers, *one.counts) for kind, one in registers.items()} == ENDS


def test_a_new_type_of_fewer_bits_than_its_registers_has_the_ends_of_its_name(monkeypatch):
    for kind, code, ends in (("uint24", "I", (0, 16777215)), ("int24", "i", (-8388608, 8388607))):
        monkeypatch.setitem(REGISTERS, kind, 2)
        monkeypatch.setitem(STRUCT_CODES, kind, code)
        narrow = Register(address=0, type="uint32").model_copy(update={"type": kind})
        assert narrow.counts == ends
        assert Block({"x": narrow}).encode({"x": 1e9}) == [ends[1] >> 16, 0xFFFF], "it saturates"


@pytest.mark.parametrize(
    ("kind", "order", "words", "value"),
    [
        # IEEE 754: 1.0 is 3F800000; the Modbus specification sends high bytes first.
        ("float32", "big", [0x3F80, 0x0000], 1.0),
        ("float32", "little", [0x0000, 0x3F80], 1.0),
        ("int32", "big", [0xFFFF, 0xFFFE], -2.0),
        ("int32", "little", [0xFFFE, 0xFFFF], -2.0),
        ("uint16", "big", [0xFFFF], 65535.0),
        ("int16", "big", [0xFFFF], -1.0),
        ("int64", "little", [0x0002, 0x0000, 0x0000, 0x0000], 2.0),
        ("float64", "big", [0x4000, 0x0000, 0x0000, 0x0000], 2.0),
    ],
)
def test_words_mean_what_the_standards_say(kind, order, words, value):
    block = Block({"x": Register(address=10, type=kind, word_order=order)})
    assert block.decode(words) == {"x": value}
    assert block.encode({"x": value}) == words


@pytest.mark.parametrize(
    ("word_order", "byte_order", "words"),
    [
        # The four orders that makers write as ABCD, CDAB, BADC and DCBA.
        ("big", "big", [0x0A0B, 0x0C0D]),
        ("little", "big", [0x0C0D, 0x0A0B]),
        ("big", "little", [0x0B0A, 0x0D0C]),
        ("little", "little", [0x0D0C, 0x0B0A]),
    ],
)
def test_words_and_bytes_can_come_in_any_order(word_order, byte_order, words):
    block = Block(
        {"x": Register(address=7, type="uint32", word_order=word_order, byte_order=byte_order)}
    )
    assert block.decode(words) == {"x": float(0x0A0B0C0D)}
    assert block.encode({"x": float(0x0A0B0C0D)}) == words


def raws(register):
    """Return every value that a register can hold."""
    if register.type.startswith("float"):
        width = int(register.type[5:])
        return st.floats(allow_nan=False, allow_infinity=False, width=width)
    return st.integers(*register.counts)


@st.composite
def encodings(draw, kind, address):
    """Return keys of an encoding that a type may have."""
    bits = int(kind.removeprefix("uint")) if kind.startswith("uint") else 0
    keys = draw(st.sampled_from([{}] if kind.startswith("float") else [{}, {"encoding": "mod10"}]))
    if not bits:
        return keys
    keys = draw(st.sampled_from([keys, {"encoding": "bcd"}]))
    direction = {"address": address, "mask": 6, "negative": draw(st.sampled_from([0, 2, 6]))}
    return keys | draw(st.sampled_from([{}, {"sign_bit": bits - 1}, {"direction": direction}]))


@st.composite
def blocks(draw):
    """Return a block of registers of any type, order, scale and distance, and a raw count or float
    for each."""
    registers, address = {}, draw(st.integers(0, 65000))
    for i, kind in enumerate(
        draw(st.lists(st.sampled_from(list(REGISTERS)), min_size=1, max_size=6))
    ):
        orders = {
            key: draw(st.sampled_from(["big", "little"])) for key in ("word_order", "byte_order")
        }
        address += draw(st.integers(0, 3))
        after = address + REGISTERS[kind]
        keys = draw(encodings(kind, after))
        registers[f"v{i}"] = Register(address=address, type=kind, **orders, **keys)
        address = after + ("direction" in keys)
    names = draw(st.permutations(list(registers)))
    return {name: registers[name] for name in names}, {
        name: draw(raws(registers[name])) for name in names
    }


@patient
@given(blocks())
def test_whatever_a_register_can_hold_comes_back_in_any_type_and_order(drawn):
    registers, values = drawn
    block = Block(registers)
    words = block.encode(values)
    assert len(words) == block.count and all(0 <= word <= 0xFFFF for word in words)
    # As a double: of a 64-bit count above 2**53 the last bits are beyond it.
    assert block.decode(words) == {name: float(value) for name, value in values.items()}


@patient
@given(blocks(), st.data())
def test_a_value_is_where_its_register_is_and_nowhere_else(drawn, data):
    registers, values = drawn
    block, name = Block(registers), data.draw(st.sampled_from(list(registers)))
    before, after = (
        block.encode(values),
        block.encode({**values, name: data.draw(raws(registers[name]))}),
    )
    own = {at - block.address for span in registers[name].spans for at in span}
    assert {place for place in range(block.count) if before[place] != after[place]} <= own


@patient
@given(blocks(), st.lists(st.integers(0, 0xFFFF), min_size=60, max_size=60))
def test_any_words_at_all_decode_to_something_for_each_register(drawn, words):
    registers, _ = drawn
    block = Block(registers)
    assert list(block.decode((words * 2)[: block.count])) == list(registers)


@patient
@given(
    kind=st.sampled_from(INTEGERS),
    scale=st.floats(1e-9, 1e3).map(lambda scale: float(f"{scale:.6g}")),
    negative=st.booleans(),
    offset=st.floats(-1e3, 1e3),
    share=st.floats(0, 1),
)
def test_a_scaled_value_comes_back_to_half_a_count(kind, scale, negative, offset, share):
    scale = -scale if negative else scale
    low, high = Register(address=0, type=kind).counts
    value = (low + share * (min(high, 2**40) - low)) * scale + offset
    block = Block({"x": Register(address=0, type=kind, scale=scale, offset=offset)})
    rounding = 4 * np.finfo(float).eps * (abs(value) + abs(offset))
    assert_allclose(
        block.decode(block.encode({"x": value}))["x"],
        value,
        rtol=0,
        atol=0.500001 * abs(scale) + rounding,
    )


@patient
@given(st.integers(0, 10), st.integers(0, 10))
def test_registers_that_overlap_are_refused_and_others_are_not(first, second):
    wide = {"type": "int32", "unit": "N"}
    registers = {
        "sequence": {"address": 100, "type": "uint16"},
        "force_x": {"address": first, **wide},
        "force_y": {"address": second, **wide},
        "force_z": {"address": 50, **wide},
    }
    if abs(first - second) >= 2:
        assert SensorMap.model_validate({"read": registers}).read.force_y.address == second
    else:
        with pytest.raises(
            ValidationError, match=rf"register {max(first, second)} is part of force_x too"
        ):
            SensorMap.model_validate({"read": registers})


def test_a_value_too_large_saturates_as_in_a_device():
    block = Block({"x": Register(address=0, type="int16", scale=0.001, unit="rad")})
    assert block.decode(block.encode({"x": 50.0}))["x"] == pytest.approx(32.767)
    assert block.registers["x"].holds(-32.0, 32.0)
    assert not block.registers["x"].holds(-33.0, 0.0)


def test_a_magnitude_with_a_sign_bit_is_read_and_written():
    block = Block({"x": Register(address=0, type="uint16", sign_bit=15, scale=0.1, unit="A")})
    assert block.decode([0x8000 | 25])["x"] == pytest.approx(-2.5)
    for value, word in ((-2.5, 0x8000 | 25), (2.5, 25), (-1e9, 0xFFFF), (1e9, 0x7FFF)):
        assert block.encode({"x": value}) == [word]
    assert block.registers["x"].span == pytest.approx((-3276.7, 3276.7))
    assert block.modulus("x") == 0.0


@pytest.mark.parametrize(("kind", "bit"), [("int16", 15), ("float32", 15), ("uint16", 16)])
def test_a_sign_bit_outside_of_an_unsigned_type_is_refused(kind, bit):
    with pytest.raises(ValueError, match="expected a bit of an unsigned type"):
        Register(address=0, type=kind, sign_bit=bit)


@pytest.mark.parametrize(
    ("keys", "words", "count"),
    [
        ({"type": "uint32", "encoding": "mod10"}, [3, 4567], 34567),
        ({"type": "uint32", "encoding": "mod10", "sign_bit": 31}, [0x8003, 4567], -34567),
        # A sign in each word, as of meters of electric power.
        ({"type": "int32", "encoding": "mod10"}, [0xFFFD, 65536 - 4567], -34567),
        ({"type": "int32", "encoding": "mod10"}, [0, 65536 - 4567], -4567),
        ({"type": "uint16", "encoding": "bcd"}, [0x1234], 1234),
        ({"type": "uint16", "encoding": "bcd", "sign_bit": 15}, [0x8234], -234),
        ({"type": "uint32", "encoding": "bcd"}, [0x1234, 0x5678], 12345678),
    ],
)
def test_decimal_digits_mean_what_makers_of_devices_say(keys, words, count):
    block = Block({"x": Register(address=5, **keys)})
    assert block.decode(words) == {"x": count}
    assert block.encode({"x": count}) == words


def test_a_sign_of_four_bits_is_read_too():
    block = Block({"x": Register(address=0, type="uint16", encoding="bcd", sign_bit=15)})
    assert block.decode([0xF234]) == {"x": -234.0}


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"type": "uint16", "encoding": "bcd"}, [0x12A4]),
        ({"type": "uint16", "encoding": "bcd", "sign_bit": 15}, [0x9234]),
        ({"type": "uint32", "encoding": "mod10"}, [0, 10000]),
        ({"type": "int32", "encoding": "mod10"}, [0, 65536 - 10000]),
    ],
)
def test_a_digit_that_is_not_decimal_makes_no_number(keys, words):
    assert np.isnan(Block({"x": Register(address=0, **keys)}).decode(words)["x"])


def test_a_direction_in_another_register_is_the_sign_of_a_magnitude():
    direction = {"address": 3, "mask": 4, "negative": 4}
    register = Register(address=7, type="uint16", scale=0.1, offset=2.0, direction=direction)
    block = Block({"x": register})
    assert block.decode([0, 0, 0, 0, 50])["x"] == pytest.approx(7.0)
    assert block.decode([0xFFFF, 0, 0, 0, 50])["x"] == pytest.approx(-3.0)
    assert block.encode({"x": -3.0}) == [4, 0, 0, 0, 50]
    assert register.span == pytest.approx((2.0 - 6553.5, 2.0 + 6553.5))


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"type": "int16", "encoding": "bcd"}, "encoding: found bcd with type int16"),
        ({"type": "float32", "encoding": "mod10"}, "expected an integer"),
        ({"type": "uint16", "encoding": "bcd", "sign_bit": 11}, "expected 12 or more with bcd"),
        ({"type": "uint32", "encoding": "mod10", "sign_bit": 15}, "expected 31 or more with mod10"),
        ({"type": "int16", "direction": {"address": 9, "negative": 1}}, "a sign of its own"),
        ({"type": "uint16", "direction": {"address": 0, "negative": 1}}, "of the value itself"),
        (
            {"type": "uint16", "direction": {"address": 9, "mask": 2, "negative": 1}},
            "negative: found 0x0001, expected bits of mask 0x0002 only",
        ),
    ],
)
def test_encodings_that_no_register_has_are_refused(keys, message):
    with pytest.raises(ValidationError, match=re.escape(message)):
        Register(address=0, **keys)


def test_a_counter_may_say_that_it_is_binary():
    counter = Register.model_validate({"address": 0, "type": "uint16", "encoding": "binary"})
    check_counter(counter, "read.sequence")
    digits = Register.model_validate({"address": 0, "type": "uint16", "encoding": "bcd"})
    with pytest.raises(ValueError, match=r"read\.sequence: .*; remove encoding"):
        check_counter(digits, "read.sequence")


def test_units_become_si():
    block = Block(
        {
            "time": Register(address=0, type="uint32", unit="us"),
            "f": Register(address=2, type="int16", unit="kN"),
        }
    )
    assert block.decode([0x000F, 0x4240, 2]) == {"time": pytest.approx(1.0), "f": 2000.0}


def test_an_unsigned_counter_wraps_after_its_span():
    block = Block(
        {
            "time": Register(address=0, type="uint32", unit="us"),
            "n": Register(address=2, type="int32"),
        }
    )
    assert block.modulus("time") == pytest.approx(2**32 * 1e-6)
    assert block.modulus("n") == 0.0

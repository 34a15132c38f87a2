import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from pipelines.registers import Block
from pipelines.settings.rig import REGISTERS, Register

INTEGERS = [name for name in REGISTERS if not name.startswith("float")]


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


@given(
    kinds=st.lists(st.sampled_from(INTEGERS), min_size=1, max_size=5),
    little=st.booleans(),
    gap=st.integers(0, 3),
    share=st.floats(-1, 1),
)
def test_a_block_gives_back_what_was_put_in_to_half_a_count(kinds, little, gap, share):
    registers, address = {}, 100
    for i, kind in enumerate(kinds):
        order = "little" if little else "big"
        registers[f"v{i}"] = Register(address=address, type=kind, word_order=order, scale=-0.01, offset=2.0, unit="deg")
        address += REGISTERS[kind] + gap
    block = Block(registers)
    values = {name: np.deg2rad(2.0 - 0.01 * abs(share) * 32767) for name in registers}
    assert_allclose(list(block.decode(block.encode(values)).values()), list(values.values()), atol=np.deg2rad(0.00501))


def test_a_value_too_large_saturates_as_in_a_device():
    block = Block({"x": Register(address=0, type="int16", scale=0.001, unit="rad")})
    assert block.decode(block.encode({"x": 50.0}))["x"] == pytest.approx(32.767)
    assert block.holds("x", -32.0, 32.0)
    assert not block.holds("x", -33.0, 0.0)


def test_units_become_si():
    block = Block(
        {"time": Register(address=0, type="uint32", unit="us"), "f": Register(address=2, type="int16", unit="kN")}
    )
    assert block.decode([0x000F, 0x4240, 2]) == {"time": pytest.approx(1.0), "f": 2000.0}


def test_an_unsigned_counter_begins_anew_after_its_span():
    block = Block({"time": Register(address=0, type="uint32", unit="us"), "n": Register(address=2, type="int32")})
    assert block.span("time") == pytest.approx(2**32 * 1e-6)
    assert block.span("n") == 0.0

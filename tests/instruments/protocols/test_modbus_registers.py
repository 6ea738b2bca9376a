"""What the words of a register mean."""

from __future__ import annotations

import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from instruments.protocols import adam6017, watlow_f4_registers, watlow_f4t_registers
from instruments.protocols.modbus_registers import Register

SIGNED = Register(100, "air", "int16", "counts")
FLOAT = Register(2820, "air", "float32", "deg C")


def test_minus_22_1_c_with_one_decimal_is_ff23() -> None:
    assert SIGNED.encode(-221, "little") == [0xFF23]
    assert SIGNED.decode([0xFF23], "little") == -221


def test_an_unsigned_register_has_no_sign() -> None:
    assert Register(0, "code").decode([0xFF23], "little") == 65315


@pytest.mark.parametrize(
    ("value", "high", "low"),
    [(25.0, 0x41C8, 0x0000), (-22.1, 0xC1B0, 0xCCCD), (1.0, 0x3F80, 0x0000), (0.0, 0, 0)],
)
def test_the_low_word_of_a_float_comes_first_unless_told_otherwise(value: float, high: int, low: int) -> None:
    assert FLOAT.encode(value, "little") == [low, high]
    assert FLOAT.encode(value, "big") == [high, low]
    assert FLOAT.decode([low, high], "little") == pytest.approx(value, rel=1e-7)
    assert FLOAT.decode([high, low], "big") == pytest.approx(value, rel=1e-7)


@given(st.integers(-32768, 32767))
def test_every_signed_count_comes_back(value: int) -> None:
    assert SIGNED.decode(SIGNED.encode(value, "little"), "little") == value


@given(st.floats(width=32, allow_nan=False), st.sampled_from(["little", "big"]))
def test_every_float_comes_back(value: float, order: str) -> None:
    words = FLOAT.encode(value, order)  # type: ignore[arg-type]  # sampled
    assert all(0 <= word <= 0xFFFF for word in words)
    assert FLOAT.decode(words, order) == value  # type: ignore[arg-type]  # sampled


def test_words_in_the_wrong_order_leave_the_range_of_a_temperature() -> None:
    for temperature_c in (-40.0, 25.0, 85.1, 150.0):
        swapped = watlow_f4t_registers.AIR.decode(watlow_f4t_registers.AIR.encode(temperature_c, "big"), "little")
        assert not watlow_f4t_registers.AIR.holds(swapped) or abs(swapped) < 1e-3


def test_nothing_holds_what_is_no_number() -> None:
    assert not FLOAT.holds(math.nan)
    assert FLOAT.holds(math.inf)
    assert not watlow_f4t_registers.AIR.holds(math.inf)


def test_equal_inputs_are_counted_by_their_stride() -> None:
    assert watlow_f4_registers.INPUT_STATE.nth(4, 12).number == 237
    assert watlow_f4_registers.EVENT.nth(8, 10).number == 2070
    assert watlow_f4t_registers.ALARM.nth(3, 100).number == 1556
    assert str(adam6017.RANGE_CODE.nth(7, 1, first=0)) == "range code of input 7 (register 207)"


@pytest.mark.parametrize("table", [watlow_f4_registers, watlow_f4t_registers, adam6017])
def test_every_declared_register_says_what_it_is_and_where_its_number_is_from(table: object) -> None:
    declared = [value for value in vars(table).values() if isinstance(value, Register)]
    assert len(declared) >= 3
    for register in declared:
        assert register.meaning
        assert register.source
        assert 0 <= register.number <= 0xFFFF
        if register.access != "r":
            assert register.low <= register.high


def test_floats_are_ieee_754() -> None:
    assert FLOAT.decode(list(struct.unpack(">HH", struct.pack(">f", 36.6))), "big") == pytest.approx(36.6, rel=1e-7)

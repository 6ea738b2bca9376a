"""Readings of messages that cantools has encoded: order, missing and repeated messages, counters, multiplexers."""

from __future__ import annotations

from typing import Any

import cantools
import numpy as np
import pytest

from instruments.drivers.can_bus import TRIAL
from instruments.protocols.can.cycles import CycleDecoder
from instruments.protocols.can.database import frame_id_of
from instruments.protocols.can.frames import BUS_OFF, ERROR, CanFrame, packed
from instruments.protocols.can.settings import CanSettings
from instruments.protocols.can.signals import COUNTER
from instruments.simulators.devices.can_bus import read_messages

HEAD = 'VERSION ""\n\nBU_: X\n\n'
#: Each message with its own counter.
COUNTED = HEAD + "\n".join(
    f'BO_ {number} M{axis}: 4 X\n SG_ Rate{axis} : 7|16@0- (0.01,0) [0|0] "deg/s" X\n'
    f' SG_ Count{axis} : 16|8@1+ (1,0) [0|255] "" X\n'
    for number, axis in enumerate("XYZ", start=256)
)
MULTIPLEXED = (
    HEAD + 'BO_ 5 M: 8 X\n SG_ Mux M : 0|2@1+ (1,0) [0|3] "" X\n SG_ RateX m0 : 8|16@1- (0.01,0) [0|0] "deg/s" X\n'
    ' SG_ RateY m1 : 8|16@1- (0.01,0) [0|0] "deg/s" X\n SG_ Other m3 : 8|16@1- (1,0) [0|0] "V" X\n'
)


def gyro(**changes: Any) -> CanSettings:
    given = {"driver": "can", "name": "imu", "serial": "C-1", "max_rate_dps": 300, **TRIAL, **changes}
    return CanSettings.model_validate(given)


def counted() -> CanSettings:
    signals = {f"gyro_{axis.lower()}": f"M{axis}.Rate{axis}" for axis in "XYZ"}
    counter = [f"M{axis}.Count{axis}" for axis in "XYZ"]
    return gyro(dbc=COUNTED, signals=signals, counter=counter, hold=[], first="", status={})


class Unit:
    """A unit whose messages cantools encodes."""

    def __init__(self, dbc: str) -> None:
        self._database = cantools.database.load_string(dbc, "dbc")

    def __call__(self, name: str, **values: Any) -> bytes:
        message = self._database.get_message_by_name(name)
        given = {each.name: 0 for each in message.signals} if not message.is_multiplexed() else {}
        return packed(CanFrame(frame_id_of(message), message.encode(given | values)))


def values(settings: CanSettings, decoded: Any) -> dict[str, list[float]]:
    scales = settings.layout().scales
    return {name: (found.offset + found.scale * decoded.values[name]).tolist() for name, found in scales.items()}


def trial_cycle(unit: Unit, n: int, state: object = "Valid") -> list[bytes]:
    return [
        unit("Rates", RateX=n + 0.001, RateY=-n - 0.002, Count=n % 16, State=state),
        unit("RateAndForce", RateZ=2.0 * n, ForceZ=9.80665),
    ]


def test_both_byte_orders_signs_offsets_and_floats() -> None:
    settings, unit = gyro(), Unit(TRIAL["dbc"])
    cycles = [unit("Housekeeping", Temperature=-40.25), *(b"".join(trial_cycle(unit, n)) for n in range(5))]
    found = CycleDecoder(settings.layout()).feed(b"".join(cycles))
    assert (len(found), found.damaged, found.missed) == (5, 0, 0)
    assert found.valid.all()
    got = values(settings, found)
    assert got["gyro_x"] == pytest.approx([n + 0.001 for n in range(5)])
    assert got["gyro_y"] == pytest.approx([-n - 0.002 for n in range(5)])
    assert got["gyro_z"] == pytest.approx([2.0 * n for n in range(5)])
    assert got["accel_z_g"] == pytest.approx([1.0] * 5, rel=1e-6)
    assert got["temperature_c"] == [-40.25] * 5
    assert found.values[COUNTER].tolist() == [0, 1, 2, 3, 4]


def test_nothing_is_read_before_what_is_held_came() -> None:
    settings, unit = gyro(), Unit(TRIAL["dbc"])
    decoder = CycleDecoder(settings.layout())
    assert len(decoder.feed(b"".join(trial_cycle(unit, 1)))) == 0
    assert decoder.missing == ["Housekeeping (0x18F00101)"]
    assert len(decoder.feed(unit("Housekeeping", Temperature=20) + b"".join(trial_cycle(unit, 2)))) == 1


def test_a_missing_message_is_one_damaged_cycle_and_mixes_nothing() -> None:
    settings, unit = gyro(), Unit(TRIAL["dbc"])
    for lost in (0, 1):
        decoder = CycleDecoder(settings.layout())
        cycles = [trial_cycle(unit, n) for n in range(6)]
        del cycles[3][lost]
        found = decoder.feed(b"".join([unit("Housekeeping", Temperature=20), *(b"".join(each) for each in cycles)]))
        got = values(settings, found)
        assert got["gyro_z"] == pytest.approx([0, 2, 4, 8, 10])
        assert got["gyro_x"] == pytest.approx([n + 0.001 for n in (0, 1, 2, 4, 5)])
        assert (found.damaged, found.missed) == (1, 1)


@pytest.mark.parametrize("seed", range(4))
def test_counters_tell_the_cycle_whatever_the_order(seed: int) -> None:
    settings, unit, random = counted(), Unit(COUNTED), np.random.default_rng(seed)
    data, whole = b"", []
    for n in range(300):
        axes = list(random.permutation(list("XYZ")))
        if random.random() < 0.1:
            axes.pop()
        else:
            whole.append(n)
        data += b"".join(unit(f"M{axis}", **{f"Rate{axis}": n / 10, f"Count{axis}": n % 256}) for axis in axes)
    found = CycleDecoder(settings.layout()).feed(data)
    for name in ("gyro_x", "gyro_y", "gyro_z"):
        assert values(settings, found)[name] == pytest.approx([n / 10 for n in whole])
    assert found.damaged == found.missed == 300 - len(whole) - (whole[-1] != 299)


def test_a_message_sent_twice_is_damaged_and_takes_no_period() -> None:
    settings, unit = counted(), Unit(COUNTED)
    cycle = [unit(f"M{axis}", **{f"Rate{axis}": 1, f"Count{axis}": 7}) for axis in "XYZ"]
    found = CycleDecoder(settings.layout()).feed(b"".join([cycle[0], *cycle]))
    assert (len(found), found.damaged, found.missed) == (1, 1, 0)


def test_multiplexed_signals_are_of_one_cycle() -> None:
    signals = {"gyro_x": "M.RateX", "gyro_y": "M.RateY"}
    settings = gyro(dbc=MULTIPLEXED, signals=signals, counter=None, hold=[], first="M.RateX", status={})
    unit = Unit(MULTIPLEXED)
    data = b""
    for n in range(4):
        data += unit("M", Mux=0, RateX=n) + unit("M", Mux=3, Other=5)
        data += b"" if n == 1 else unit("M", Mux=1, RateY=-n)
    found = CycleDecoder(settings.layout()).feed(data)
    assert values(settings, found) == {"gyro_x": [0, 2, 3], "gyro_y": [0, -2, -3]}
    assert found.damaged == 1


def test_bad_status_the_end_of_the_range_and_no_number_are_not_valid() -> None:
    settings, unit = gyro(), Unit(TRIAL["dbc"])
    rates, rest = trial_cycle(unit, 1)
    nan = packed(CanFrame(417, bytes.fromhex("8000" + "0000c07f")))
    at_its_end = unit("Rates", RateX=-524.288, Count=3, State="Valid")
    cycles = [
        trial_cycle(unit, 0),
        trial_cycle(unit, 1, state="Fault"),
        [rates, nan],
        [at_its_end, rest],
        [rates, rest],
    ]
    data = unit("Housekeeping", Temperature=20) + b"".join(part for each in cycles for part in each)
    assert CycleDecoder(settings.layout()).feed(data).valid.tolist() == [True, False, False, False, True]


def test_frames_of_others_errors_and_short_messages() -> None:
    settings, unit = gyro(), Unit(TRIAL["dbc"])
    decoder = CycleDecoder(settings.layout())
    rates, rest = trial_cycle(unit, 1)
    error = packed(CanFrame(ERROR | 0x88, bytes(8)))
    data = [unit("Housekeeping", Temperature=20), packed(CanFrame(0x7FF, b"x")), error, rates, rest]
    found = decoder.feed(b"".join(data))
    assert (len(found), found.damaged, found.missed) == (1, 1, 0)
    assert decoder.errors == {"protocol violation": 1, "bus error": 1}
    assert not decoder.is_bus_off
    short = decoder.feed(packed(CanFrame(416, b"\x01\x02")) + rest)
    assert (len(short), short.missed) == (0, 1)
    decoder.feed(packed(CanFrame(ERROR | BUS_OFF, bytes(8))))
    assert decoder.is_bus_off


def random_dbc(random: np.random.Generator) -> str:
    """Return a message with signals of random size, sign and byte order that fill it without overlap."""
    lines, at, number = [f"{HEAD}BO_ 77 M: 8 X"], 0, 0
    while at < 64:
        bits = min(int(random.integers(1, 33)), 64 - at)
        motorola, signed = bool(random.integers(2)), bool(random.integers(2))
        if motorola and at % 8 == 0:
            start = at + 7  # of the byte's most significant bit; a Motorola signal then fills whole bytes
            bits = max(8, 8 * (bits // 8))
            bits = min(bits, 64 - at)
        else:
            motorola, start = False, at
        scale = float(random.choice([1, 0.5, 0.01]))
        lines.append(
            f' SG_ S{number} : {start}|{bits}@{int(not motorola)}{"-" if signed else "+"} ({scale},{number}) [0|0] "" X'
        )
        at, number = at + bits, number + 1
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("seed", range(30))
def test_the_simulated_unit_packs_bits_as_cantools_does(seed: int) -> None:
    """Two implementations: the simulated unit's own, and that of the library which the driver reads by."""
    random = np.random.default_rng(seed)
    dbc = random_dbc(random)
    theirs = cantools.database.load_string(dbc, "dbc").get_message_by_name("M")
    ours = read_messages(dbc)["M"]
    for _ in range(20):
        given = {}
        for signal in theirs.signals:
            low = -(1 << (signal.length - 1)) if signal.is_signed else 0
            raw = int(random.integers(low, low + (1 << signal.length)))
            given[signal.name] = signal.offset + signal.scale * raw
        assert ours.frame(given)[8:] == theirs.encode(given, strict=False)

"""A stream whose bytes are held back again and again, against a generator of its own that knows when each was taken."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest
from numpy.typing import NDArray

from instruments.interfaces.gyro import Readings
from instruments.transport.device_time import DeviceTime
from instruments.transport.sample_timing import StreamTime
from instruments.transport.undecided import Undecided

WIDTH_S = 0.016  #: an FTDI adapter as delivered


@dataclass
class Unit:
    """Readings of a unit: their numbers, when each was taken and when it arrived, (n,)."""

    number: NDArray[np.int64]
    taken_s: NDArray[np.float64]
    arrival_s: NDArray[np.float64]

    @classmethod
    def make(
        cls, rate_hz: float, span_s: float, seed: int = 0, held_s: tuple[float, float] = (0.0, 0.0),
        lost: tuple[float, int] = (0.0, 0),
    ) -> Unit:  # fmt: skip
        """`lost` readings from a time on never come; holds begin every 0.1 to 0.7 s and end with bytes in pieces."""
        rng = np.random.default_rng(seed)
        number = np.arange(int(span_s * rate_hz))
        first = int(lost[0] * rate_hz)
        number = np.delete(number, slice(first, first + lost[1]))
        taken_s = 0.0037 + number / rate_hz
        arrival_s, begin_s = taken_s.copy(), 0.5
        while held_s[1] and begin_s < span_s:
            end_s = begin_s + rng.uniform(*held_s)
            held = np.flatnonzero((taken_s >= begin_s) & (arrival_s < end_s))
            arrival_s[held] = end_s + 0.001 * (np.arange(len(held)) // 3)  # 62 bytes a packet, a packet each ms
            begin_s += rng.uniform(0.1, 0.7)
        arrival_s = np.ceil((np.maximum.accumulate(arrival_s) + 1e-4) / 0.004) * 0.004  # a thread looks every 4 ms
        return cls(number, taken_s, arrival_s)


@dataclass
class Heard:
    """What a driver makes of a unit."""

    stream: StreamTime
    device_time: DeviceTime | None = None
    undecided: Undecided = field(default_factory=Undecided)
    parts: list[Readings] = field(default_factory=list)
    polled_s: list[float] = field(default_factory=list)  #: by how much the readings of a poll are after arrival
    worst: float = 0.0  #: deviation of the period in use from the nominal one, as a share

    def joined(self) -> Readings:
        whole = self.parts[0]
        for part in self.parts[1:]:
            whole = part.after(whole)
        return whole


def listen(unit: Unit, period_s: float, until_s: float, wrap: int = 0, further_s: int = 0) -> Heard:
    """Poll three times and read for six seconds, again and again, as a campaign does; read `further_s` at the end."""
    device_time = DeviceTime(period_s, wrap) if wrap else None
    heard = Heard(StreamTime(period_s, 0.0), device_time)
    position, now_s = 0, 0.0

    def take(keep: bool = True) -> None:
        nonlocal position
        end = int(np.searchsorted(unit.arrival_s, now_s, side="right"))
        rows, position = slice(position, end), end
        if not keep or rows.start == rows.stop:
            return
        number, arrival_s = unit.number[rows], unit.arrival_s[rows]
        advance = np.ones(len(number), dtype=np.int64)
        if wrap:
            advance[1:] = (np.diff(number) - 1) % wrap + 1
        t_s, lost = heard.stream.times(advance, now_s, wrap, width_s=WIDTH_S, arrival_s=arrival_s)
        heard.worst = max(heard.worst, abs(period_s / heard.stream.line.period_s - 1.0))
        lost += int(advance.sum()) - len(advance)
        found = Readings(t_s, {"n": number}, np.ones(len(number), bool), lost, arrival_s=arrival_s)
        ticks = number % wrap if wrap else None
        heard.parts.append(heard.undecided.pass_on(found, heard.stream, device_time, ticks))

    while now_s < until_s:
        for _ in range(3):
            now_s += 1.0
            take(keep=False)
            heard.stream.drop()
            heard.undecided.drop()
            while not (heard.parts and len(heard.parts[-1]) and heard.parts[-1].arrival_s[-1] > now_s - 0.01):  # type: ignore[index]
                now_s += 0.00125
                take()
            poll = heard.parts.pop()
            assert poll.arrival_s is not None
            heard.polled_s.append(float((poll.t_s - poll.arrival_s).max()))
        for _ in range(6):
            now_s += 1.0
            take()
    for _ in range(further_s):
        now_s += 1.0
        take()
    return heard


@pytest.mark.parametrize("rate_hz", [96.2, 98.0, 101.0, 103.9])
@pytest.mark.parametrize("seed", range(3))
def test_held_bytes_are_not_lost_and_no_reading_is_later_than_it_arrived(rate_hz: float, seed: int) -> None:
    unit = Unit.make(rate_hz, 60.0, seed, held_s=(0.1, 0.4))
    heard = listen(unit, 0.01, 45.0)
    found = heard.joined()
    assert found.lost == 0
    assert heard.worst < 0.0401
    assert found.arrival_s is not None
    assert (found.t_s <= found.arrival_s + 1e-9).all()
    assert max(heard.polled_s) <= 1e-9
    settled = found.only(found.t_s > 20.0)
    taken_s = unit.taken_s[np.searchsorted(unit.number, settled.raw["n"])]
    assert np.abs(settled.t_s - taken_s).max() < 0.02
    assert np.all(np.diff(found.t_s) > 0)


@pytest.mark.parametrize(("missing", "wrap"), [(8, 0), (20, 0), (16, 16), (32, 16), (21, 16)])
def test_what_never_comes_is_lost_and_the_times_after_it_are_right(missing: int, wrap: int) -> None:
    """Also of the readings between the loss and its discovery: they are passed on once it is decided."""
    unit = Unit.make(101.0, 60.0, lost=(41.3, missing))
    found = listen(unit, 1 / 101.0 if wrap else 0.01, 45.0, wrap).joined()
    assert found.lost == missing
    later = found.only(found.t_s > 36.5)
    taken_s = unit.taken_s[np.searchsorted(unit.number, later.raw["n"])]
    assert later.raw["n"][0] < 41.3 * 101.0 < later.raw["n"][-1]
    assert np.abs(later.t_s - taken_s).max() < 0.02
    if wrap:
        assert later.device_s is not None
        ticks = (later.device_s - later.device_s[0]) * 101.0
        assert ticks == pytest.approx(later.raw["n"] - later.raw["n"][0], abs=1e-6)


def test_a_stream_that_ends_while_it_is_open_gives_what_was_kept_once_and_in_order() -> None:
    unit = Unit.make(101.0, 60.0, lost=(44.8, 16))
    heard = listen(unit, 1 / 101.0, 44.0, wrap=16)
    assert heard.stream.is_late
    before = heard.joined()
    kept = heard.undecided.take(heard.device_time)
    assert kept is not None
    assert heard.undecided.take() is None
    number = np.concatenate([before.raw["n"], kept.raw["n"]])
    assert list(kept.raw["n"]) == [n for n in unit.number if before.raw["n"][-1] < n <= number[-1]]
    assert kept.t_s[0] > before.t_s[-1]
    assert (np.diff(kept.t_s) > 0).all()
    assert before.device_s is not None
    assert kept.device_s is not None
    assert kept.device_s[0] > before.device_s[-1]


def test_readings_are_kept_back_while_it_is_open_whether_some_are_lost_and_come_once_it_is_decided() -> None:
    unit = Unit.make(101.0, 60.0, lost=(44.8, 8))
    heard = listen(unit, 0.01, 44.0)
    assert heard.stream.is_late
    assert (heard.joined().lost, heard.joined().raw["n"][-1] < 44.8 * 101.0) == (0, True)
    found = listen(unit, 0.01, 44.0, further_s=2).joined()
    assert found.lost == 8
    number = found.raw["n"][found.raw["n"] > 44.2 * 101.0]
    assert list(number) == [n for n in unit.number if number[0] <= n <= number[-1]]
    assert number[-1] > 46.0 * 101.0

"""The wiggle test: which unit moved when a person turned one by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from instruments.bench import Bench
from instruments.bench_config import BenchFile, read_bench
from instruments.clock import VirtualClock
from instruments.drivers.unit_handlers import ManualUnitHandler
from instruments.interfaces.gyro import Channel, GyroIdentity, Readings
from labctl.errors import BadInput
from labctl.services.benches import wiggle as module
from labctl.services.benches.wiggle import wiggle_units
from tests.helpers.fake_instruments import UNIT

HZ = 50.0


class Hand:
    """A person who turns what is asked for, as the sentences say; `wires`: unit asked -> units that move."""

    def __init__(self, clock: VirtualClock, wires: dict[str, list[str]]) -> None:
        self._clock, self._wires = clock, wires
        self._moving: dict[str, tuple[float, float]] = {}
        self.heard: list[str] = []

    def say(self, line: str) -> None:
        self.heard.append(line)
        if line.startswith("turn unit "):
            begin_s = self._clock.now_s() + 4.0  # it takes a while to reach for the unit
            self._moving = dict.fromkeys(self._wires[line.split()[2]], (begin_s, begin_s + 3.0))

    def rate_dps(self, name: str, t_s: Any) -> Any:
        begin_s, end_s = self._moving.get(name, (0.0, 0.0))
        return np.where((t_s >= begin_s) & (t_s < end_s), 40.0 * np.sin(4.0 * (t_s - begin_s)), 0.0)


class Unit:
    """A unit with a bias and noise, whose stream is buffered between reads."""

    axes = ("z",)
    channels = (Channel("gyro_z", "deg/s", 1e-4), Channel("status", "", 1.0))
    sample_rate_hz = HZ
    limits = UNIT

    def __init__(self, name: str, clock: VirtualClock, hand: Hand, noise_dps: float) -> None:
        self.name, self._clock, self._hand, self._noise_dps = name, clock, hand, noise_dps
        self._rng = np.random.default_rng(len(name))
        self._next = 0

    def identify(self) -> GyroIdentity:
        return GyroIdentity("1", "fake")

    def start(self) -> None:
        self._next = int(self._clock.now_s() * HZ) + 1

    def read_latest(self) -> Readings:
        return self.read(0.1)

    def read(self, duration_s: float) -> Readings:
        self._clock.sleep(duration_s)
        last = int(self._clock.now_s() * HZ)
        t_s = np.arange(self._next, last + 1) / HZ
        self._next = last + 1
        rates = self._hand.rate_dps(self.name, t_s) + 1.5 + self._noise_dps * self._rng.standard_normal(len(t_s))
        raw = {"gyro_z": np.round(rates / 1e-4).astype(np.int64), "status": np.zeros(len(t_s), dtype=np.int64)}
        return Readings(t_s, raw, np.ones(len(t_s), dtype=bool))

    def stop(self) -> None: ...


def run(wires: dict[str, list[str]], noise_dps: float = 0.1) -> tuple[Any, Hand]:
    record = read_bench("by-hand-sim").model_dump()
    unit = record["gyros"][0]
    record["gyros"] = [unit | {"name": n, "serial": f"S-{n}", "port": f"/dev/{n}"} for n in wires]
    bench, clock = BenchFile.model_validate(record), VirtualClock()
    hand = Hand(clock, wires)
    units: Any = {name: Unit(name, clock, hand, noise_dps) for name in wires}
    return wiggle_units(bench, "mine", Bench(None, None, units, ManualUnitHandler()), clock, hand.say), hand


def test_units_on_their_own_ports_are_right() -> None:
    answer, hand = run({"a": ["a"], "b": ["b"], "c": ["c"]})
    assert answer.ok
    assert [unit.text for unit in answer.units] == [
        "the unit is on /dev/a",
        "the unit is on /dev/b",
        "the unit is on /dev/c",
    ]
    assert hand.heard[0] == "leave every unit at rest for 3 s"
    assert hand.heard[1:3] == [
        "turn unit a (S-a) by hand, back and forth; leave the others at rest", "unit a was to be turned; a moved",
    ]  # fmt: skip


def test_exchanged_ports_are_named_with_what_to_set() -> None:
    answer, _ = run({"a": ["b"], "b": ["a"], "c": ["c"]})
    assert not answer.ok
    assert [(unit.ok, unit.text) for unit in answer.units] == [
        (False, "b moved instead, so the two ports are exchanged: set port = '/dev/b' for a in the bench file"),
        (False, "a moved instead, so the two ports are exchanged: set port = '/dev/a' for b in the bench file"),
        (True, "the unit is on /dev/c"),
    ]
    around, _ = run({"a": ["b"], "b": ["c"], "c": ["a"]})
    assert {unit.text.split(":")[0] for unit in around.units} == {
        f"{other} moved instead, so the ports do not fit the names" for other in "abc"
    }


@pytest.mark.parametrize(
    ("moves", "says"),
    [
        ([], "no unit moved within 60 s: turn the unit by more than a quarter turn, and check its port /dev/a"),
        (["a", "b"], "a and b moved: turn only the named unit, and start again"),
    ],
)
def test_no_unit_or_several_units_that_move_are_reported(moves: list[str], says: str) -> None:
    answer, _ = run({"a": moves, "b": ["b"]})
    assert (answer.units[0].ok, sorted(answer.units[0].moved), answer.units[1].ok) == (False, moves, True)
    assert answer.units[0].text.split(": ", 1)[1] == says.split(": ", 1)[1]


def test_a_unit_that_moves_while_it_is_to_rest_and_a_silent_one_are_refused() -> None:
    with pytest.raises(BadInput, match=r"a: the unit moved \(.* deg/s\) during .*; start again"):
        run({"a": ["a"]}, noise_dps=8.0)


def test_noise_alone_is_no_movement(monkeypatch: pytest.MonkeyPatch) -> None:
    """2 deg/s of noise: 240 blocks of each of two units at rest, and none is taken for a movement."""
    monkeypatch.setattr(module, "WITHIN_S", 120.0)
    answer, _ = run({"a": [], "b": []}, noise_dps=2.0)
    assert [unit.moved for unit in answer.units] == [[], []]

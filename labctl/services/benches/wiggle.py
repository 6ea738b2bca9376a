"""The wiggle test: a person turns one unit after the other by hand, and the readings say on which port each one is.

Where the wire tells nothing, only this shows that the readings of two units do not go under each other's serial number.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from instruments.bench import Bench, open_bench
from instruments.bench_config import BenchFile
from instruments.clock import Clock
from instruments.interfaces.gyro import Gyro, Readings
from labctl.answers.benches import WiggleResponse, WiggleUnit
from labctl.errors import BadInput
from labctl.services.benches.check import clock_of
from labctl.services.planning.loading import load_bench
from procedures.monitoring.turn_course import Nominal, nominal_outputs

#: All units are at rest for so long before the first one is turned, and again before the next, s.
REST_S, REST_BETWEEN_S = 3.0, 1.0
#: All units are read this often, s.
BLOCK_S = 0.25
#: How long a movement is waited for, and followed once it has begun, s.
WITHIN_S, FOLLOW_S = 60.0, 2.0
#: A unit moves when the RMS of its rates, less those at rest, exceeds both limits: one in deg/s, and one as a multiple
#: of its scatter at rest.
MIN_DPS, TIMES_SCATTER = 5.0, 10.0
#: A further unit that moves more than this share of the fastest was turned too.
ALSO_SHARE = 0.2

Say = Callable[[str], None]
Rates = NDArray[np.float64]


@dataclass(frozen=True)
class AtRest:
    """Mean (axes,) and scatter of the rates of a unit at rest, deg/s."""

    mean_dps: Rates
    scatter_dps: float

    @property
    def limit_dps(self) -> float:
        """Root mean square of the rates, less those at rest, above which the unit counts as moving, deg/s."""
        return max(MIN_DPS, TIMES_SCATTER * self.scatter_dps)


def wiggle(source: str, say: Say) -> WiggleResponse:
    """Ask for one unit of a bench after the other to be turned, and return which moved; `say` gets each sentence.

    Raises BadInput for a unit without a gyro channel, InstrumentError.
    """
    bench = load_bench(source)
    clock = clock_of(bench)
    return wiggle_units(bench, source, open_bench(bench, clock), clock, say)


def wiggle_units(bench: BenchFile, source: str, opened: Bench, clock: Clock, say: Say) -> WiggleResponse:
    """Carry out the test on an open bench, and close it; raises as `wiggle`."""
    try:
        test = _Test(opened.gyros, clock)
        say(f"leave every unit at rest for {REST_S:g} s")
        test.learn_rest()
        moved = {}
        for unit in bench.gyros:
            say(f"turn unit {unit.name} ({unit.serial}) by hand, back and forth; leave the others at rest")
            moved[unit.name] = test.moved()
            say(_said(unit.name, moved[unit.name]))
            test.await_rest()
    finally:
        opened.close()
    units = [_unit(bench, name, rates, moved) for name, rates in moved.items()]
    return WiggleResponse(bench=source, ok=all(unit.ok for unit in units), units=units)


class _Test:
    """The units, read in turn while their ports buffer."""

    def __init__(self, gyros: Mapping[str, Gyro], clock: Clock) -> None:
        self._gyros, self._clock = gyros, clock
        self._outputs: dict[str, dict[str, Nominal]] = {}
        for name, gyro in gyros.items():
            outputs = nominal_outputs(tuple(gyro.channels), gyro.identify().output)
            if not outputs:
                raise BadInput(f"{name}: the unit has no gyro channel to compare; leave the unit out of the bench file")
            self._outputs[name] = outputs
            gyro.start()
            gyro.read_latest()
        self._rest: dict[str, AtRest] = {}

    def learn_rest(self) -> None:
        """Learn what each unit sends at rest; raises BadInput for one that moves meanwhile."""
        blocks = [self._read() for _ in range(round(REST_S / BLOCK_S))]
        for name in self._gyros:
            rates = np.concatenate([block[name] for block in blocks])
            if len(rates) < 2:
                raise BadInput(f"{name}: {len(rates)} readings in {REST_S:g} s at rest; run `labctl bench check` first")
            mean = np.mean(rates, axis=0)
            scatter = float(np.std(rates, axis=0, ddof=1).max())
            if scatter > MIN_DPS:
                raise BadInput(
                    f"{name}: the unit moved ({scatter:.2g} deg/s) during the time in which it must "
                    "be at rest; start again, and leave it at rest"
                )
            self._rest[name] = AtRest(mean, scatter)

    def moved(self) -> list[str]:
        """Return the units that moved, the fastest first; empty where none did in time."""
        end_s = self._clock.now_s() + WITHIN_S
        largest = dict.fromkeys(self._gyros, 0.0)
        begun = False
        while self._clock.now_s() < end_s:
            for name, share in self._shares(self._read()).items():
                largest[name] = max(largest[name], share)
            if not begun and max(largest.values()) > 1.0:
                begun, end_s = True, self._clock.now_s() + FOLLOW_S
        fastest = max(largest.values())
        moved_units = [name for name, share in largest.items() if share > max(1.0, ALSO_SHARE * fastest)]
        return sorted(moved_units, key=lambda name: -largest[name])

    def await_rest(self) -> None:
        """Wait until all units are at rest again, at most as long as for a movement."""
        end_s, still_s = self._clock.now_s() + WITHIN_S, 0.0
        while still_s < REST_BETWEEN_S and self._clock.now_s() < end_s:
            still_s = still_s + BLOCK_S if max(self._shares(self._read()).values()) <= 1.0 else 0.0

    def _read(self) -> dict[str, Rates]:
        """Return the rates (n, axes) of each unit since the last call, deg/s."""
        rates = {}
        for name, gyro in self._gyros.items():
            readings = gyro.read(max(BLOCK_S / len(self._gyros), 1.5 / gyro.sample_rate_hz))
            rates[name] = _rates(readings, self._outputs[name])
        return rates

    def _shares(self, rates: Mapping[str, Rates]) -> dict[str, float]:
        """Return the root mean square of each unit's rates, less those at rest, as a share of its limit."""
        return {
            name: float(np.sqrt(np.mean(np.sum((rate - self._rest[name].mean_dps) ** 2, axis=1))))
            / self._rest[name].limit_dps
            if len(rate)
            else 0.0
            for name, rate in rates.items()
        }


def _rates(readings: Readings, outputs: Mapping[str, Nominal]) -> Rates:
    return np.column_stack([output.rate_dps(readings.raw[output.channel.name]) for output in outputs.values()])


def _said(expected_unit: str, moved_units: list[str]) -> str:
    return f"unit {expected_unit} was to be turned; {' and '.join(moved_units) or 'nothing'} moved"


def _unit(bench: BenchFile, name: str, moved_units: list[str], moved: Mapping[str, list[str]]) -> WiggleUnit:
    settings = {gyro.name: gyro for gyro in bench.gyros}
    port = settings[name].port or settings[name].host or ""
    if moved_units == [name]:
        text = f"the unit is on {port}"
    elif not moved_units:
        text = (
            f"no unit moved within {WITHIN_S:g} s: turn the unit by more than a quarter turn, and check its port {port}"
        )
    elif len(moved_units) > 1:
        text = f"{' and '.join(moved_units)} moved: turn only the named unit, and start again"
    else:
        (other,) = moved_units
        link = settings[other].port or settings[other].host
        exchanged = "the two ports are exchanged" if moved.get(other) == [name] else "the ports do not fit the names"
        text = f"{other} moved instead, so {exchanged}: set port = '{link}' for {name} in the bench file"
    return WiggleUnit(
        unit=name, serial=settings[name].serial, port=port, moved=moved_units, ok=moved_units == [name], text=text
    )

"""The world that all simulated instruments of a bench share: a table that turns, air that warms, units that feel both.

Its formulas are its own; nothing here is taken from the effects that are fitted to what it gives.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from instruments.bench_config import BenchFile, GyroSettings, SimulationSettings
from instruments.simulators.hidden import HiddenEffect, State, hidden_effects
from instruments.simulators.links.serial_port import BUFFER_BYTES
from instruments.simulators.physics.ambient import humidity_pct, supply_wander_v
from instruments.simulators.physics.motion import TableMotion
from instruments.simulators.physics.thermal import Body, Heat
from instruments.simulators.physics.unit_profiles import UnitTruth, make_unit

Array = NDArray[np.float64]
EARTH_DPS = 360.0 / 86164.0905
NOISE_GRID_S = 1.0
#: Units are made to be sampled by what they are: the wire's own rate unless the bench file says otherwise.
USUAL_RATE_HZ = {"stim300": 125.0, "kvh-dsp3000": 100.0, "kvh-rd2100": 10.0, "gyrostar": 10.0}


@dataclass(frozen=True)
class GyroSample:
    """What a unit's insides give before its electronics format it."""

    rate_dps: Array  #: (n, axes)
    temperature_c: Array  #: (n, axes)
    supply_v: Array  #: (n,)


class World:
    """Everything the simulated instruments have in common."""

    room_bytes = BUFFER_BYTES  #: what a port keeps unread; what an instrument sent beyond it is lost

    def __init__(self, bench: BenchFile) -> None:
        settings = bench.simulation or SimulationSettings()
        self.settings = settings
        latitude = settings.latitude_deg if settings.latitude_deg is not None else bench.latitude_deg
        self.latitude_deg = 0.0 if latitude is None else latitude
        self.turns_with_earth = latitude is not None
        self.north_deg = float(settings.table.get("north_deg", 33.0))
        self.table = TableMotion(
            bench.table.steps_per_turn,
            step_error_deg=float(settings.table.get("step_error_deg", 0.0225)),
            gear_error_deg=float(settings.table.get("gear_error_deg", 0.0)),
        )
        self.position, self.mounting, self.run = "z", 0, 0
        self.powered_on_s: float | None = None
        truths = {gyro.name: self._make(gyro, settings) for gyro in bench.gyros}
        self.start_c = start_c = float(settings.chamber.get("start_c", 25.0))
        bodies = {
            name: Body(t.sensor_tau_s, t.self_heating_c, t.heating_tau_s, t.deep_tau_s, start_c, start_c)
            for name, t in truths.items()
        }
        self.heat = Heat(
            start_c,
            bench.chamber.ramp_c_per_min,
            float(settings.chamber.get("air_tau_s", 180.0)),
            bodies,
            float(settings.chamber.get("noise_c", 0.02)),
            settings.seed + 1000 * settings.noise_seed,
        )
        self._gyros = {gyro.name: SimulatedGyro(self, gyro, truths[gyro.name]) for gyro in bench.gyros}

    @staticmethod
    def _make(gyro: GyroSettings, settings: SimulationSettings) -> UnitTruth:
        seed = [settings.seed, zlib.crc32(gyro.serial.encode())]
        return make_unit(gyro.driver, tuple(gyro.axes), settings.units.get(gyro.name, {}), seed)

    def gyro(self, name: str) -> SimulatedGyro:
        """Return a unit of the bench."""
        return self._gyros[name]

    @staticmethod
    def humidity_pct(t_s: Array) -> Array:
        """Return the relative humidity of the room at times (n,), per cent."""
        return humidity_pct(t_s)

    def mount(self, t_s: float, position: str) -> None:  # noqa: ARG002  a hand is quicker than a second
        """Turn every unit so that body axis `position` points up along the table axis."""
        self.position = position
        self.mounting += 1

    def power(self, t_s: float, on: bool) -> None:
        """Switch every unit on or off."""
        if on and self.powered_on_s is None:
            self.powered_on_s = t_s
            self.run += 1
        elif not on:
            self.powered_on_s = None
        self.heat.power(t_s, on=on)

    def body_frame(self) -> tuple[int, int, int, float]:
        """Return (up axis, two level axes that follow it in cyclic order, sign of up)."""
        up = "xyz".index(self.position.lstrip("-"))
        sign = -1.0 if self.position.startswith("-") else 1.0
        return up, (up + 1) % 3, (up + 2) % 3, sign

    def body_rates(self, table_dps: Array, angle_deg: Array) -> Array:
        """Return the inertial rate in body axes, (n, 3) deg/s: the table's and the Earth's."""
        up, first, second, sign = self.body_frame()
        rates = np.zeros((len(table_dps), 3))
        rates[:, up] = sign * table_dps
        if self.turns_with_earth:
            latitude = np.radians(self.latitude_deg)
            rates[:, up] += sign * EARTH_DPS * np.sin(latitude)
            heading = np.radians(angle_deg - self.north_deg)
            level = EARTH_DPS * np.cos(latitude)
            rates[:, first] += level * np.cos(heading)
            rates[:, second] -= sign * level * np.sin(heading)
        return rates

    def gravity(self, n: int) -> Array:
        """Return the specific force in body axes, (n, 3) g: one g up."""
        up, _, _, sign = self.body_frame()
        g = np.zeros((n, 3))
        g[:, up] = sign
        return g


class SimulatedGyro:
    """One unit of the world: what it would give at times that only rise."""

    def __init__(self, world: World, settings: GyroSettings, truth: UnitTruth) -> None:
        self.world = world
        self.settings = settings
        self.truth = truth
        self.sample_rate_hz = settings.sample_rate_hz or USUAL_RATE_HZ[settings.driver]
        seed = [world.settings.seed, zlib.crc32(settings.name.encode()), zlib.crc32(settings.serial.encode())]
        self._rng = np.random.default_rng([*seed, world.settings.noise_seed])
        self._taus = np.asarray(truth.instability_taus_s)
        shape = (len(self._taus), len(truth.axes))
        self._drift_sd = truth.instability_dps / np.sqrt(len(self._taus))
        self._drift = self._rng.normal(0.0, self._drift_sd, shape)
        self._next_drift = self._drift.copy()
        self._drift_at_s = 0.0
        self._hidden: list[HiddenEffect] = hidden_effects(world.settings.hidden, seed)
        self._rows = ["xyz".index(axis) for axis in truth.axes]

    def sample(self, t_s: Array) -> GyroSample:
        """Return what the unit gives at times (n,), rising; each integrates the motion over one sampling interval."""
        world, truth, n = self.world, self.truth, len(t_s)
        period = 1.0 / self.sample_rate_hz
        ends = world.table.angle_deg(np.concatenate([t_s - period, t_s]))
        table_dps, angle = (ends[n:] - ends[:n]) / period, 0.5 * (ends[n:] + ends[:n])
        body = world.body_rates(table_dps, angle)
        sensor = world.heat.sensor_c(self.settings.name, t_s)
        gain = truth.gain(sensor)
        rate = np.einsum("nij,nj->ni", gain, body) + truth.offset(sensor)
        if truth.bend is not None:
            rate = rate + truth.bend(body[:, self._rows], sensor)
        on_s = t_s - (world.powered_on_s if world.powered_on_s is not None else 0.0)
        if truth.warm_up is not None:
            rate = rate + truth.warm_up(np.maximum(on_s, 0.0))[:, None]
        shown = sensor
        if self._hidden:
            state = self._state(t_s, table_dps, angle, body, sensor, on_s)
            for effect in self._hidden:
                rate = rate + effect.error_dps(state, rate)
                shown = shown + effect.thermometer_c(state)
        white = self._rng.standard_normal((n, len(truth.axes) + 1))
        rate = rate + self._drifts(t_s) + truth.white_dps_rthz * np.sqrt(self.sample_rate_hz) * white[:, :-1]
        thermometer = shown[:, None] + truth.thermometer_noise_c * white[:, -1:]
        return GyroSample(rate, np.repeat(thermometer, len(truth.axes), axis=1), truth.supply_v + supply_wander_v(t_s))

    def _state(self, t_s: Array, table_dps: Array, angle: Array, body: Array, sensor: Array, on_s: Array) -> State:
        world = self.world
        return State(
            t_s=t_s,
            on_s=on_s,
            table_dps=table_dps,
            angle_deg=angle,
            body_dps=body,
            own_dps=body[:, self._rows],
            rows=self._rows,
            g=world.gravity(len(t_s)),
            sensor_c=sensor,
            start_c=world.start_c,
            deep_c=world.heat.deep_c(self.settings.name, t_s),
            air_c=world.heat.airs_c(t_s),
            sensor_k_min=6.0 * (sensor - world.heat.sensor_c(self.settings.name, np.maximum(t_s - 10.0, 0.0))),
            run=world.run,
            mounting=world.mounting,
            full_scale_dps=self.settings.max_rate_dps,
            north_deg=world.north_deg,
            supply_wander_v=supply_wander_v(t_s),
            humidity_pct=humidity_pct(t_s),
            own_at=self._own_at,
        )

    def _own_at(self, t_s: Array) -> Array:
        """Return the rates along the recorded axes at times (k,), from the table's motion."""
        half = 0.05
        angle = self.world.table.angle_deg(np.concatenate([t_s - half, t_s + half]))
        k = len(t_s)
        return self.world.body_rates((angle[k:] - angle[:k]) / (2 * half), angle[:k])[:, self._rows]

    def _drifts(self, t_s: Array) -> Array:
        """Return the bias instability, (n, axes): Ornstein-Uhlenbeck on a grid of seconds, straight lines between."""
        out = np.empty((len(t_s), len(self.truth.axes)))
        start = 0
        while start < len(t_s):
            if t_s[start] >= self._drift_at_s + NOISE_GRID_S:
                self._step_drift(float(t_s[start]))
            stop = int(np.searchsorted(t_s, self._drift_at_s + NOISE_GRID_S, side="left"))
            share = ((t_s[start:stop] - self._drift_at_s) / NOISE_GRID_S)[:, None]
            out[start:stop] = self._drift.sum(0) * (1 - share) + self._next_drift.sum(0) * share
            start = stop
        return out

    def _step_drift(self, t_s: float) -> None:
        skipped = max(np.floor((t_s - self._drift_at_s) / NOISE_GRID_S) - 1.0, 0.0) * NOISE_GRID_S
        self._drift = self._later(self._next_drift, skipped) if skipped else self._next_drift
        self._drift_at_s += skipped + NOISE_GRID_S
        self._next_drift = self._later(self._drift, NOISE_GRID_S)

    def _later(self, drift: Array, elapsed_s: float) -> Array:
        keep = np.exp(-elapsed_s / self._taus)[:, None]
        return keep * drift + self._drift_sd * np.sqrt(1 - keep**2) * self._rng.standard_normal(drift.shape)

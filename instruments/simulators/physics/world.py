"""The world that all simulated instruments of a bench share: table motion, heat, Earth rotation and the units.

Its formulas are its own: no effect that is fitted to simulated data shares a formula with this package.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime

import numpy as np
from numpy.typing import NDArray

from instruments.bench_config import USUAL_AIR_TAU_S, BenchFile, GyroSettings, SimulationSettings
from instruments.clock import VIRTUAL_START
from instruments.positions import Position
from instruments.simulators.hidden import HiddenEffect, State, hidden_effects
from instruments.simulators.physics.bench_errors import UPRIGHT, BenchErrors, felt
from instruments.simulators.physics.body_kinematics import BodyFrame, EarthRotation
from instruments.simulators.physics.hand_motion import HandMotion
from instruments.simulators.physics.instability import BiasInstability
from instruments.simulators.physics.motion import TableMotion
from instruments.simulators.physics.servo_motion import ServoMotion
from instruments.simulators.physics.supply_output import REGULATED, SupplyOutput
from instruments.simulators.physics.thermal import Body, Heat
from instruments.simulators.physics.tumbling import Tumbling
from instruments.simulators.physics.unit_profiles import UnitTruth, make_unit, usual_rate_hz


class ProfileMotion:
    """Angle of a table whose rate is given at even times; at rest before and after."""

    def __init__(self, start_s: float, step_s: float, rates_dps: Array) -> None:
        """Take rates (k,), the first at `start_s`; both ends are 0, and steps are short against any change."""
        self._start_s, self._step_s, self._rates = start_s, step_s, rates_dps
        slope = np.gradient(rates_dps, step_s)
        # trapezoids with the first correction of Euler and Maclaurin
        parts = step_s * (rates_dps[1:] + rates_dps[:-1]) / 2 - step_s**2 / 12 * (slope[1:] - slope[:-1])
        self._angles = np.concatenate([[0.0], np.cumsum(parts)])
        self.end_s = start_s + step_s * (len(rates_dps) - 1)

    def angle_deg(self, t_s: Array) -> Array:
        """Return the angle at times (n,), degrees, by cubics that have the rates as their slopes."""
        at = np.clip((t_s - self._start_s) / self._step_s, 0.0, len(self._rates) - 1.0)
        k = np.minimum(at.astype(np.int64), len(self._rates) - 2)
        u = at - k
        first, second = self._step_s * self._rates[k], self._step_s * self._rates[k + 1]
        rise = self._angles[k + 1] - self._angles[k]
        bend = u * (1 - u) * ((1 - u) * (first - rise) + u * (rise - second))
        return np.asarray(self._angles[k] + u * rise + bend)

    def commanded_deg(self, t_s: Array) -> Array:
        """Return the angle that was asked for, degrees: a servo's is the true one."""
        return self.angle_deg(t_s)


def supply_wander_v(t_s: Array) -> Array:
    """Return the deviation of an unregulated supply voltage from nominal, (n,) V, at times (n,) s."""
    return _waves(t_s, (0.06, 5.3, 0.0), (0.04, 1.7, 1.0))


def humidity_pct(t_s: Array) -> Array:
    """Return the relative humidity around the bench, (n,) per cent, at times (n,) s."""
    return 45.0 + _waves(t_s, (4.0, 23.0, 2.0), (3.0, 6.1, 0.5), (1.5, 2.3, 4.0))


def _waves(t_s: Array, *waves: tuple[float, float, float]) -> Array:
    """Return a sum of waves, each of an amplitude, a period in hours and a phase."""
    hours = np.asarray(t_s) / 3600.0
    return np.asarray(sum(size * np.sin(2 * np.pi * hours / period + phase) for size, period, phase in waves))


Array = NDArray[np.float64]

#: One g, m/s^2.
STANDARD_G = 9.80665
#: Values for a table and a chamber that a bench does not have: neither ever moves.
USUAL_STEPS_PER_TURN, USUAL_RAMP_C_PER_MIN = 1600, 1.67


@dataclass(frozen=True)
class GyroSample:
    """Output of a unit before its electronics format it."""

    rate_dps: Array  #: (n, axes)
    temperature_c: Array  #: (n, axes)
    supply_v: Array  #: (n,)
    table_dps: Array  #: (n,) mean over the sampling interval, as the unit feels it


def number(settings: Mapping[str, object], name: str, usual: float) -> float:
    """Return a setting of the simulation; raises ValueError where it is no number."""
    value = settings.get(name, usual)
    if not isinstance(value, int | float):
        raise ValueError(f"[simulation] {name} = {value!r} is not a number; correct it")
    return float(value)


class World:
    """Shared state of the simulated instruments. Raises ValueError for an unknown profile, setting or effect."""

    def __init__(self, bench: BenchFile, starts_at: datetime = VIRTUAL_START) -> None:
        """Make the world of a bench; `starts_at` is the instant of its time 0: units age by the calendar."""
        settings = bench.simulation or SimulationSettings()
        self.starts_at = starts_at
        self.settings = settings
        self.supply = None if bench.supply is None else SupplyOutput(bench.supply.nominal_v)  #: of the units
        self.north_deg = number(settings.table, "north_deg", 33.0)
        latitude_deg = settings.latitude_deg if settings.latitude_deg is not None else bench.latitude_deg
        self.errors = BenchErrors.drawn(bench.standards, [settings.seed]) if settings.draw_standards else BenchErrors()
        leaning_deg = None if latitude_deg is None else latitude_deg + self.errors.level_deg
        self._earth = EarthRotation(leaning_deg, self.north_deg)
        self.table = TableMotion(
            USUAL_STEPS_PER_TURN if bench.table is None else bench.table.steps_per_turn,
            step_error_deg=number(settings.table, "step_error_deg", 0.0225),
            gear_error_deg=number(settings.table, "gear_error_deg", 0.0),
        )
        self.hand = HandMotion(settings.hand, self.table, [settings.seed, settings.noise_seed, zlib.crc32(b"hand")])
        self.servo: ServoMotion | None = None  #: instead of the stepper, on a bench with a servo table
        self._profile: ProfileMotion | None = None
        self.tumbling: Tumbling | None = None  #: instead of all others, once a person has turned the units to a pose
        self._encoder_noise_deg = number(settings.table, "encoder_noise_deg", 0.0)
        self._encoder_late_s = number(settings.table, "encoder_late_s", 0.0)
        self._encoder_rng = np.random.default_rng([settings.seed, settings.noise_seed, zlib.crc32(b"encoder")])
        self.position, self.mounting, self.run = Position.of("z"), 0, 0
        self._usual_radius_m = None if bench.eccentricity is None else bench.eccentricity.radius_m
        self._lean_rad = UPRIGHT  #: of the axis of rotation in the frame of the units
        self.powered_on_s: float | None = None
        truths = {gyro.name: self._make(gyro, settings) for gyro in bench.gyros}
        self.start_c = start_c = number(settings.chamber, "start_c", 25.0)
        bodies = {
            name: Body(t.sensor_tau_s, t.self_heating_c, t.heating_tau_s, t.deep_tau_s, start_c, start_c)
            for name, t in truths.items()
        }
        self.heat = Heat(
            start_c,
            USUAL_RAMP_C_PER_MIN if bench.chamber is None else bench.chamber.ramp_c_per_min,
            number(settings.chamber, "air_tau_s", USUAL_AIR_TAU_S),
            bodies,
            number(settings.chamber, "noise_c", 0.02),
            settings.seed + 1000 * settings.noise_seed,
            self.errors.air_c,
        )
        self._gyros = {gyro.name: SimulatedGyro(self, gyro, truths[gyro.name]) for gyro in bench.gyros}

    @staticmethod
    def _make(gyro: GyroSettings, settings: SimulationSettings) -> UnitTruth:
        seed = [settings.seed, zlib.crc32(gyro.serial.encode())]
        return make_unit(gyro.driver, tuple(gyro.axes), settings.units.get(gyro.name, {}), seed)

    def gyro(self, name: str) -> SimulatedGyro:
        """Return a unit of the bench; raises KeyError."""
        return self._gyros[name]

    def follow(self, t_s: float, step_s: float, rates_dps: Array) -> float:
        """Make the table follow rates (k,) deg/s at even times from `t_s` on; returns the time of the last."""
        self._profile = ProfileMotion(t_s, step_s, rates_dps)
        return self._profile.end_s

    def leave_profile(self) -> None:
        """Return the table to its stepper motion."""
        self._profile = None

    @property
    def motion(self) -> TableMotion | ServoMotion | ProfileMotion | HandMotion:
        """What moves the units: the stepper or servo, a course of rates that the table follows, or a hand."""
        if self._profile is not None:
            return self._profile
        if self.servo is not None:
            return self.servo
        return self.hand if self.hand.has_turned else self.table

    def table_turns(self, t_s: float) -> bool:
        """Return whether the table turns at a time, s."""
        return (self.servo or self.table).moving(t_s)

    def encoder_rates_dps(self, t_s: Array, period_s: float) -> Array:
        """Return the mean rates by the table's encoder over the periods that end at times (n,) s, in one row.

        Each reading of the angle has noise, and its time stamps may be late: settings `encoder_noise_deg` and
        `encoder_late_s` of the simulated table.
        """
        times = np.concatenate([t_s[:1] - period_s, t_s]) - self._encoder_late_s
        noise = self._encoder_noise_deg * self._encoder_rng.standard_normal(len(times))
        return np.asarray(np.diff(self.motion.angle_deg(times) + noise) / period_s)

    def supply_v(self, t_s: Array, usual_v: float = 0.0) -> Array:
        """Return the supply voltage of the units at times (n,) s, (n,) V; `usual_v` is that without a [supply]."""
        if self.supply is None:
            return usual_v + supply_wander_v(t_s)
        return self.supply.volts(t_s) + REGULATED * supply_wander_v(t_s)

    @staticmethod
    def humidity_pct(t_s: Array) -> Array:
        """Return the relative humidity of the air around the bench at times (n,), per cent."""
        return humidity_pct(t_s)

    def mount(self, t_s: float, position: str) -> None:  # noqa: ARG002  mounting takes no time
        """Mount every unit in a position. Raises ValueError for one that is none."""
        self.position = Position.of(position)
        self.mounting += 1
        self._lean_rad = self.errors.lean_rad(self.position, self.mounting)

    def turn_by_hand(self, t_s: float, position: str, turn_deg: float) -> None:
        """Make the hand turn every unit by an angle, deg, about body axis `position`, which points up."""
        self.position = Position.of(self.hand.turn(t_s, position, turn_deg))

    def lay(self, t_s: float, up: Sequence[float]) -> None:
        """Make a person turn the units until direction `up` (3,) of the body points up; they lie as mounted before."""
        if self.tumbling is None:
            seed = [self.settings.seed, self.settings.noise_seed, zlib.crc32(b"poses")]
            self.tumbling = Tumbling(self.gravity(np.zeros(1))[0], self.hand.rate_dps, self.hand.reaction_s, seed)
        self.tumbling.lay(t_s, up)

    def tumbled_rates(self, t_s: Array, period_s: float) -> Array:
        """Return the inertial rate in body axes, (n, 3) deg/s, of units that a person turns from pose to pose."""
        assert self.tumbling is not None
        earth = np.einsum("nji,j->ni", self.tumbling.attitudes(t_s), self._earth.laboratory_dps)
        return np.asarray(self.tumbling.rates_dps(t_s, period_s) + earth)

    def power(self, t_s: float, on: bool) -> None:
        """Switch the power of every unit."""
        if on and self.powered_on_s is None:
            self.powered_on_s = t_s
            self.run += 1
        elif not on:
            self.powered_on_s = None
        self.heat.power(t_s, on=on)

    def body_rates(self, table_dps: Array, angle_deg: Array) -> Array:
        """Return the inertial rate in body axes, (n, 3) deg/s: table and Earth, at table angles (n,)."""
        frame = BodyFrame.of(self.position)
        rates = self._earth.body_rates(frame, table_dps / (1.0 + self.errors.rate), angle_deg)
        return frame.in_body(felt(rates, frame, self._lean_rad))

    def gravity(self, t_s: Array) -> Array:
        """Return the specific force in body axes at times (n,), (n, 3) g: one g up."""
        if self.tumbling is not None:
            return np.asarray(self.tumbling.attitudes(t_s)[:, 2])
        return BodyFrame.of(self.position).gravity(len(t_s))

    @property
    def radius_m(self) -> float | None:
        """The true distance of the units from the axis of the table, m; None on a bench that does not state it."""
        stated_m = self.position.radius_m
        if stated_m is None:
            return self._usual_radius_m
        return max(stated_m - self.errors.radius_m, 0.0)

    def specific_force(self, t_s: Array, table_dps: Array) -> Array:
        """Return the specific force in body axes at times and table rates (n,), (n, 3) g: gravity and the way round."""
        force = self.gravity(t_s)
        if not self.radius_m or self.tumbling is not None:
            return force
        omega = table_dps * (np.pi / 180.0)
        return force - np.outer(omega * omega * (self.radius_m / STANDARD_G), self._outwards())

    def _outwards(self) -> Array:
        """Return the unit vector away from the axis of the table, (3,), in the frame of the body."""
        if (stated := self.position.outwards) is not None:
            return np.array(stated)
        frame = BodyFrame.of(replace(self.position, fixture_deg=0))
        return frame.in_body(frame.outwards())


def _memory_of(hidden: list[HiddenEffect]) -> tuple[Array, Array]:
    """Return the moments before now, (k,) s, and their weights, (k,), of all hidden responses one after the other."""
    past_s, weights = np.zeros(1), np.ones(1)
    for memory in filter(None, (effect.memory() for effect in hidden)):
        past_s = np.add.outer(past_s, memory[0]).ravel()
        weights = np.multiply.outer(weights, memory[1]).ravel()
    return past_s, weights


class SimulatedGyro:
    """One unit of the world, sampled at times that only rise."""

    def __init__(self, world: World, settings: GyroSettings, truth: UnitTruth) -> None:
        self.world = world
        self.settings = settings
        self.truth = truth
        nominal_hz = settings.sample_rate_hz or usual_rate_hz(settings.driver)
        self.sample_rate_hz = nominal_hz * (1.0 + 1e-6 * truth.sample_clock_ppm)  #: as its own clock makes it
        seed = [world.settings.seed, zlib.crc32(settings.name.encode()), zlib.crc32(settings.serial.encode())]
        self._rng = np.random.default_rng([*seed, world.settings.noise_seed])
        # one generator for both noises: instability draws first here, white noise first in every sample
        self._instability = BiasInstability(self._rng, truth.instability_dps, truth.instability_taus_s, len(truth.axes))
        self.drifts = True  #: whether its bias wanders; a third of the time that a sample takes
        self._hidden: list[HiddenEffect] = hidden_effects(world.settings.hidden, seed)
        self._rows = ["xyz".index(axis) for axis in truth.axes]
        self._past_s, self._weights = _memory_of(self._hidden)

    def sample(self, t_s: Array) -> GyroSample:
        """Return the output at rising times (n,) s; each reading integrates the motion over one sampling interval."""
        world, truth, n = self.world, self.truth, len(t_s)
        period = 1.0 / self.sample_rate_hz
        table_dps, angle = self._felt(t_s, period)
        tumbled = world.tumbling is not None
        body = world.tumbled_rates(t_s, period) if tumbled else world.body_rates(table_dps, angle)
        sensor = world.heat.sensor_c(self.settings.name, t_s)
        gain, offset = truth.gain(sensor), truth.offset(sensor)
        if truth.ageing is not None:
            years = truth.ageing.years(world.starts_at, t_s)
            gain, offset = gain * truth.ageing.gain(years)[:, :, None], offset + truth.ageing.bias_dps(years)
        rate = np.einsum("nij,nj->ni", gain, body) + offset
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
        if self.drifts:
            rate = rate + self._instability.sample(t_s)
        rate = rate + truth.white_dps_rthz * np.sqrt(self.sample_rate_hz) * white[:, :-1]
        thermometer = shown[:, None] + truth.thermometer_noise_c * white[:, -1:]
        warm_c = np.repeat(thermometer, len(truth.axes), axis=1)
        return GyroSample(rate, warm_c, world.supply_v(t_s, truth.supply_v), table_dps)

    def _felt(self, t_s: Array, period_s: float) -> tuple[Array, Array]:
        """Return the table's mean rate over each sampling interval, deg/s, and its angle as they are felt, (n,)."""
        n, ends = len(t_s), np.zeros(2 * len(t_s))
        for past_s, weight in zip(self._past_s, self._weights, strict=True):
            ends += weight * self.world.motion.angle_deg(np.concatenate([t_s - period_s, t_s]) - past_s)
        return (ends[n:] - ends[:n]) / period_s, 0.5 * (ends[n:] + ends[:n])

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
            g=world.gravity(t_s),
            force_g=world.specific_force(t_s, table_dps),
            radius_m=world.radius_m,
            sensor_c=sensor,
            start_c=world.start_c,
            deep_c=world.heat.deep_c(self.settings.name, t_s),
            air_c=world.heat.airs_c(t_s),
            sensor_k_min=6.0 * (sensor - world.heat.sensor_c(self.settings.name, np.maximum(t_s - 10.0, 0.0))),
            run=world.run,
            mounting=world.mounting,
            session=world.settings.noise_seed,
            full_scale_dps=self.settings.max_rate_dps,
            north_deg=world.north_deg,
            supply_wander_v=world.supply_v(t_s) - (0.0 if world.supply is None else world.supply.nominal_v),
            humidity_pct=humidity_pct(t_s),
            own_at=self._own_at,
        )

    def _own_at(self, t_s: Array) -> Array:
        """Return the rates along the recorded axes, (k, axes) deg/s, at times (k,), from the motion of the table."""
        half = 0.05
        angle = self.world.motion.angle_deg(np.concatenate([t_s - half, t_s + half]))
        k = len(t_s)
        return self.world.body_rates((angle[k:] - angle[:k]) / (2 * half), angle[:k])[:, self._rows]

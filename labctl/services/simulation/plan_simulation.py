"""Walk through a plan in the simulated world without its wires: the same physics, hours of bench time in seconds.

The instruments' bytes are left out, so a reading keeps the value that the unit would have sent, unquantised.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from instruments.bench_config import BenchFile, GyroSettings, SimulationSettings, part_of
from instruments.clock import VirtualClock
from instruments.interfaces.rate_course import RateCourse
from instruments.protocols.arrick_c4_moves import plan_move
from instruments.protocols.arrick_c4_settings import StepperSettings
from instruments.simulation import open_simulation
from labctl.errors import BadInput
from labctl.recording import Recording, RecordingInfo
from labctl.recording.columns import ARRIVAL_S, DEVICE_S, RATE_TIME_U, VERIFICATION
from labctl.services.benches.standards import standards_of
from procedures.contracts.steps import Acquire, Mount, MoveChamber, PowerOff, PowerOn, SetSupply, Step
from procedures.planning.chamber_time import counted_move_s
from procedures.planning.plan import Plan
from procedures.planning.step_writer import MOUNTING_S, ROOM_C

#: Interval of the environment log, s.
ENVIRONMENT_S = 10.0


def simulate(plan: Plan, bench: BenchFile, gyro: GyroSettings, *, drifts: bool = True) -> Recording:
    """Return the recording that a plan gives in the simulated world, one row per reading. Raises BadInput.

    Without `drifts` the bias of the unit does not wander, for a question about the plan and not about the output.
    """
    if plan.recipe.turns is not None or bench.table is None or bench.chamber is None:
        raise BadInput(
            f"recipe {plan.recipe.name} on bench {bench.name}: turns by hand cannot be simulated without a "
            "campaign; run `labctl campaign start` on a simulated bench, such as by-hand-sim"
        )
    try:
        walk = _Walk(plan, bench, gyro, drifts=drifts)
    except ValueError as error:
        raise BadInput(f"bench {bench.name}: {error}") from error
    walk.run()
    return walk.recording()


class _Walk:
    """State of a walk through a plan."""

    def __init__(self, plan: Plan, bench: BenchFile, gyro: GyroSettings, *, drifts: bool) -> None:
        self._plan, self._bench, self._settings = plan, bench, gyro
        self._clock = VirtualClock()
        self._world = open_simulation(bench, self._clock).world
        self._unit = self._world.gyro(gyro.name)
        self._unit.drifts = drifts
        self._period = 1.0 / self._unit.sample_rate_hz
        self._t = 0.0
        self._power_on_s: float | None = None
        assert bench.table is not None
        assert bench.chamber is not None
        self._table = bench.table
        self._run, self._setpoint = 0, bench.chamber.safe_c
        self._ramp_c_per_min, self._air_c = bench.chamber.ramp_c_per_min, ROOM_C
        self._parts: list[dict[str, NDArray[np.generic]]] = []
        self._environment: list[tuple[float, int, float, float, float]] = []

    def run(self) -> None:
        """Take every step of the plan."""
        for step in self._plan.steps:
            begun = self._t
            match step:
                case PowerOn():
                    self._world.power(self._t, True)
                    self._power_on_s, self._run = self._t, step.run
                case PowerOff():
                    self._world.power(self._t, False)
                case Mount():
                    self._world.mount(self._t, step.position)
                case MoveChamber():
                    self._world.heat.set(self._t, step.temperature_c)
                    self._setpoint = step.temperature_c
                case SetSupply():
                    self._set_supply(step)
                case Acquire():
                    self._acquire(step)
                case _:
                    pass
            self._t = max(self._t, begun + self._counted_s(step))
            self._log(begun, self._t)

    def _set_supply(self, step: SetSupply) -> None:
        assert self._world.supply is not None  # such a step is planned for a bench with a supply only
        self._world.supply.set(self._t, step.voltage_v)

    def _counted_s(self, step: Step) -> float:
        """Return how long a step takes at least, s, whatever is known of the bench: a seed gives the same again."""
        if isinstance(step, Mount):
            return MOUNTING_S  # as on a bench where a person turns the units
        if not isinstance(step, MoveChamber):
            return step.expected_s
        way_c, self._air_c = abs(step.temperature_c - self._air_c), step.temperature_c
        if not step.wait:
            return 0.0
        return counted_move_s(way_c, self._ramp_c_per_min, step.band_c)

    def _log(self, from_s: float, until_s: float) -> None:
        if self._power_on_s is None:
            return
        times = np.arange(np.ceil(from_s / ENVIRONMENT_S), np.floor(until_s / ENVIRONMENT_S) + 1) * ENVIRONMENT_S
        times = times[(times > from_s) & (times <= until_s)]
        if len(times):
            temperatures_c = self._world.heat.sensor_c(self._settings.name, times)
            air = self._world.heat.airs_c(times)
            rows = zip(times.tolist(), temperatures_c.tolist(), air.tolist(), strict=True)
            self._environment += [(t, self._run, sensor, value_c, self._setpoint) for t, sensor, value_c in rows]

    def _acquire(self, step: Acquire) -> None:
        if step.course is None:
            self._take(step)
        else:
            self._follow(step, step.course)

    def _follow(self, step: Acquire, course: RateCourse) -> None:
        """Make the table follow a course of rates, and read it by its encoder."""
        times = np.arange(0.0, course.duration_s + course.step_s / 2, course.step_s)
        rates = course.rate_dps(np.minimum(times, course.duration_s))
        fastest, most = float(np.abs(rates).max()), self._table.max_rate_dps
        if fastest > most:
            raise BadInput(
                f"recipe {self._plan.recipe.name}: a {course.kind} reaches {fastest:g} deg/s, but the limit of "
                f"the table of bench {self._bench.name} is {most:g} deg/s; make it slower"
            )
        lead = self._lead(rates[0], course.step_s), self._lead(rates[-1], course.step_s)[::-1]
        self._t = self._world.follow(self._t, course.step_s, np.concatenate([lead[0], rates, lead[1]]))
        end = self._t - course.step_s * len(lead[1])
        n = round(course.duration_s / self._period)
        read_s = end - self._period * np.arange(n - 1, -1, -1.0)
        self._read(step, read_s, self._world.encoder_rates_dps(read_s, self._period), step.dataset)
        self._world.leave_profile()

    def _lead(self, rate_dps: float, step_s: float) -> NDArray[np.float64]:
        """Return the rates from rest to a rate, (k,) deg/s."""
        steps = int(np.ceil(abs(rate_dps) / self._table.acceleration_dps2 / step_s)) + 1
        return np.linspace(0.0, rate_dps, steps, endpoint=False)

    def _take(self, step: Acquire) -> None:
        table, step_deg = self._world.table, self._world.table.step_deg
        achieved, steady_from = 0.0, self._t
        if step.rate_dps:
            run = plan_move(part_of(self._table, StepperSettings), step.rate_dps, step.settle_s + step.duration_s + 1.0)
            achieved = float(np.copysign(run.step_hz * step_deg, step.rate_dps))
            end_s = table.start(self._t, run.steps, run.step_hz, self._table.acceleration_dps2)
            steady_from += run.ramp_s
        else:
            end_s = self._t + step.settle_s + step.duration_s
        first = steady_from + step.settle_s + self._period
        times = first + np.arange(round(step.duration_s / self._period), dtype=np.float64) * self._period
        self._read(step, times, np.full(len(times), achieved), step.dataset)
        self._t = max(end_s, float(times[-1]))

    def _read(self, step: Acquire, times: NDArray[np.float64], rate_dps: NDArray[np.float64], dataset: int) -> None:
        sample = self._unit.sample(times)
        n = len(times)
        part: dict[str, NDArray[np.generic]] = {
            "dataset": np.full(n, dataset, dtype=np.int64),
            "t_s": times,
            DEVICE_S: self._device_s(times),
            ARRIVAL_S: times,  # there is no wire here: a reading arrives when it is made
            "position": np.full(n, step.position),
            "run": np.full(n, step.run, dtype=np.int64),
            "mounting": np.full(n, step.mounting, dtype=np.int64),
            "power_s": times - (self._power_on_s or 0.0),
            "table_rate_dps": rate_dps,
            "table_angle_deg": self._world.motion.commanded_deg(
                times - self._period / 2
            ),  # at the middle of the interval that a reading averages
            "temperature_c": sample.temperature_c.mean(axis=1),
            "chamber_c": self._world.heat.airs_c(times),
            "chamber_setpoint_c": np.full(n, self._setpoint),
            "supply_v": sample.supply_v,
            "humidity_pct": self._world.humidity_pct(times),
        }
        if self._plan.recipe.profiles:  # there is no wire here, so the time of the reference is known
            part |= {name: np.zeros(n) for name in sorted(RATE_TIME_U)}
        if self._plan.recipe.verification is not None:
            part[VERIFICATION] = np.full(n, int(step.verification), dtype=np.int64)
        part |= {f"gyro_{axis}": sample.rate_dps[:, i] for i, axis in enumerate(self._settings.axes)}
        self._parts.append(part)

    def _device_s(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the times (n,) s of evenly spaced readings by the unit's count of them since it was switched on."""
        since_s = float(times[0]) - (self._power_on_s or 0.0) if len(times) else 0.0
        return (np.ceil(since_s / self._period - 1e-6) + np.arange(len(times))) * self._period

    def recording(self) -> Recording:
        """Return everything that was acquired."""
        settings = self._settings
        info = RecordingInfo(
            serial=settings.serial,
            model=settings.model,
            axes=settings.axes,
            kind="samples",
            motion=self._plan.recipe.motion,
            started_at=self._clock.utc(),
            latitude_deg=self._bench.latitude_deg,
            sample_rate_hz=self._unit.sample_rate_hz,
            max_rate_dps=settings.max_rate_dps,
            technology=settings.technology or None,
            datasheet=settings.datasheet,
            datasheet_conventions=settings.datasheet_conventions,
            standards=standards_of(self._bench),
            notes=f"simulated: recipe {self._plan.recipe.name}, seed {self._seed()}",
        )
        columns = {name: np.concatenate([part[name] for part in self._parts]) for name in self._parts[0]}
        names = ("t_s", "run", "temperature_c", "chamber_c", "chamber_setpoint_c")
        rows = list(zip(*self._environment, strict=True))
        environment: Mapping[str, NDArray[np.generic]] = {
            name: np.asarray(values) for name, values in zip(names, rows, strict=True)
        }
        return Recording(info, columns, environment)

    def _seed(self) -> int:
        return self._bench.simulation.seed if self._bench.simulation else 1


def hidden_recording(
    plan: Plan, bench: BenchFile, gyro: GyroSettings, seed: int, hidden: Mapping[str, float], *, drifts: bool = True
) -> Recording:
    """Return a simulated recording with effects hidden in its unit, effect id -> size in its coefficient unit."""
    settings = (bench.simulation or SimulationSettings()).model_copy(update={"seed": seed, "hidden": dict(hidden)})
    alone = bench.model_copy(update={"gyros": (gyro,), "simulation": settings})
    return simulate(plan, alone, gyro, drifts=drifts)

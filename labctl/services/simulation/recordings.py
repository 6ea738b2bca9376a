"""A recording made in the simulated world without its wires: the same physics and plan, hours of bench time in seconds.

The instruments' bytes are left out, so a reading keeps the value that the unit would have sent, unquantised.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from instruments.bench_config import BenchFile, GyroSettings, SimulationSettings
from instruments.clock import VirtualClock
from instruments.protocols.arrick_c4_moves import plan_move
from instruments.simulation import hidden_defaults, open_simulation
from labctl.errors import BadInput
from labctl.recording import Recording, RecordingInfo, write_recording
from labctl.services.planning.loading import bench_for, limits_of, load_bench, load_recipe
from labctl.services.schemas.base import Request, ResponseModel
from procedures.contracts.steps import Acquire, Mount, MoveChamber, PowerOff, PowerOn
from procedures.planning.plan import Plan, make_plan

DEFAULT_RATE_HZ = 10.0
ENVIRONMENT_S = 10.0


class SimulateRequest(Request):
    """Which recipe on which simulated bench, and what is hidden in its gyro."""

    recipe: str
    bench: str | None = None
    gyro: str | None = None
    hide: list[str] = Field(default_factory=list)
    seed: int = Field(default=1, ge=0)
    sample_rate_hz: float | None = Field(default=None, ge=0.1, le=2000, allow_inf_nan=False)
    clip: bool = False


class SimulateResponse(ResponseModel):
    """What was made."""

    serial: str
    datasets: int
    readings: int
    hidden: dict[str, float]
    folder: str


@dataclass(frozen=True)
class Made:
    """A simulated recording, and what it was made from."""

    recording: Recording
    plan: Plan
    bench: BenchFile
    hidden: Mapping[str, float]  #: effect id -> size that was hidden


def simulate_recording(request: SimulateRequest, out: Path, file_format: Literal["parquet", "csv"]) -> SimulateResponse:
    """Simulate a campaign and write its recording to a new folder. Raises BadInput, RecipeError, PlanRefused."""
    made = make_recording(request)
    write_recording(made.recording, out, file_format)
    return SimulateResponse(
        serial=made.recording.info.serial, datasets=made.plan.datasets, readings=len(made.recording),
        hidden=dict(made.hidden), folder=str(out),
    )  # fmt: skip


def make_recording(request: SimulateRequest, serial: str | None = None) -> Made:
    """Simulate a campaign, the unit under another serial number if one is named.

    Raises BadInput, RecipeError, PlanRefused.
    """
    recipe = load_recipe(request.recipe)
    bench = load_bench(request.bench or bench_for(recipe))
    gyro = _gyro(bench, request.gyro)
    hidden = hidden_sizes([text for text in request.hide if not _is_z(text)])
    rate_hz = request.sample_rate_hz or DEFAULT_RATE_HZ
    gyro = gyro.model_copy(update={"sample_rate_hz": rate_hz, "serial": serial or gyro.serial})
    simulation = (bench.simulation or SimulationSettings()).model_copy(update={"seed": request.seed, "hidden": hidden})
    bench = bench.model_copy(update={"gyros": (gyro,), "simulation": simulation})
    plan = make_plan(recipe, limits_of(bench), clip=request.clip)
    if wanted := [text for text in request.hide if _is_z(text)]:
        from labctl.services.simulation.sizing import Sizing  # noqa: PLC0415  it simulates itself

        sizing, known = Sizing(plan, bench, gyro), hidden_sizes([text.partition("=")[0] for text in wanted])
        for text in wanted:
            name, _, z = text.partition("=z")
            hidden[name] = sizing.size_of(name, float(z), known[name])
        simulation = simulation.model_copy(update={"hidden": hidden})
        bench = bench.model_copy(update={"simulation": simulation})
    return Made(simulate(plan, bench, gyro), plan, bench, hidden)


def _gyro(bench: BenchFile, name: str | None) -> GyroSettings:
    found = [gyro for gyro in bench.gyros if name in {None, gyro.name}]
    if not found:
        raise BadInput(f"bench {bench.name} has no gyro {name!r} (there are {', '.join(g.name for g in bench.gyros)})")
    return found[0]


def _is_z(text: str) -> bool:
    """Whether a size is given in noise units: `EFFECT=z10`."""
    return re.fullmatch(r"[^=]+=z\d+(\.\d+)?", text) is not None


def hidden_sizes(texts: list[str]) -> dict[str, float]:
    """Read `EFFECT` or `EFFECT=SIZE`; without a size one that a person would notice. Raises BadInput."""
    known = hidden_defaults()
    sizes: dict[str, float] = {}
    for text in texts:
        name, _, size = text.partition("=")
        if name not in known:
            raise BadInput(f"effect {name!r} cannot be hidden (there are {', '.join(sorted(known))})")
        try:
            sizes[name] = float(size) if size else known[name]
            if not math.isfinite(sizes[name]):
                raise ValueError(size)
        except ValueError:
            raise BadInput(
                f"hide {text}: size {size!r} is not a finite number (in the effect's coefficient unit)"
            ) from None
    return sizes


def with_hidden_effects(bench: BenchFile, texts: list[str]) -> BenchFile:
    """Return a simulated bench with effects hidden in its units, `EFFECT` or `EFFECT=SIZE`. Raises BadInput."""
    if not texts:
        return bench
    if not bench.is_simulated:
        raise BadInput(
            f"hide {', '.join(texts)}: bench {bench.name} is not simulated here; effects can be hidden in simulated "
            "units only, leave the key out"
        )
    simulation = bench.simulation or SimulationSettings()
    hidden = {**simulation.hidden, **hidden_sizes(texts)}
    return bench.model_copy(update={"simulation": simulation.model_copy(update={"hidden": hidden})})


def simulate(plan: Plan, bench: BenchFile, gyro: GyroSettings) -> Recording:
    """Walk through a plan in the simulated world and return what its unit gives, one row per reading."""
    try:
        walk = _Walk(plan, bench, gyro)
    except ValueError as error:
        raise BadInput(f"bench {bench.name}: {error}") from error
    walk.go()
    return walk.recording()


class _Walk:
    """The state of a walk through a plan."""

    def __init__(self, plan: Plan, bench: BenchFile, gyro: GyroSettings) -> None:
        self._plan, self._bench, self._settings = plan, bench, gyro
        self._clock = VirtualClock()
        self._world = open_simulation(bench, self._clock).world
        self._unit = self._world.gyro(gyro.name)
        self._period = 1.0 / self._unit.sample_rate_hz
        self._t = 0.0
        self._power_on_s: float | None = None
        self._run, self._setpoint = 0, bench.chamber.safe_c
        self._parts: list[dict[str, NDArray[Any]]] = []
        self._environment: list[tuple[float, int, float, float, float]] = []

    def go(self) -> None:
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
                case Acquire():
                    self._acquire(step)
                case _:
                    pass
            self._t = max(self._t, begun + step.expected_s)
            self._log(begun, self._t)

    def _log(self, from_s: float, until_s: float) -> None:
        if self._power_on_s is None:
            return
        times = np.arange(np.ceil(from_s / ENVIRONMENT_S), np.floor(until_s / ENVIRONMENT_S) + 1) * ENVIRONMENT_S
        times = times[(times > from_s) & (times <= until_s)]
        if len(times):
            warm = self._world.heat.sensor_c(self._settings.name, times)
            air = self._world.heat.airs_c(times)
            rows = zip(times.tolist(), warm.tolist(), air.tolist(), strict=True)
            self._environment += [(t, self._run, sensor, there, self._setpoint) for t, sensor, there in rows]

    def _acquire(self, step: Acquire) -> None:
        table, step_deg = self._world.table, self._world.table.step_deg
        achieved, steady_from = 0.0, self._t
        if step.rate_dps:
            run = plan_move(self._bench.table, step.rate_dps, step.settle_s + step.duration_s + 1.0)
            achieved = float(np.copysign(run.step_hz * step_deg, step.rate_dps))
            end_s = table.start(self._t, run.steps, run.step_hz, self._bench.table.acceleration_dps2)
            steady_from += run.ramp_s
        else:
            end_s = self._t + step.settle_s + step.duration_s
        first = steady_from + step.settle_s + self._period
        times = first + np.arange(round(step.duration_s / self._period), dtype=np.float64) * self._period
        sample = self._unit.sample(times)
        n = len(times)
        part: dict[str, NDArray[Any]] = {
            "dataset": np.full(n, step.dataset, dtype=np.int64),
            "t_s": times,
            "position": np.full(n, step.position),
            "run": np.full(n, step.run, dtype=np.int64),
            "mounting": np.full(n, step.mounting, dtype=np.int64),
            "power_s": times - (self._power_on_s or 0.0),
            "table_rate_dps": np.full(n, achieved),
            "table_angle_deg": table.commanded_deg(times - self._period / 2),  # amid what a reading averages
            "temperature_c": sample.temperature_c.mean(axis=1),
            "chamber_c": self._world.heat.airs_c(times),
            "chamber_setpoint_c": np.full(n, self._setpoint),
            "supply_v": sample.supply_v,
            "humidity_pct": self._world.humidity_pct(times),
        }
        part |= {f"gyro_{axis}": sample.rate_dps[:, i] for i, axis in enumerate(self._settings.axes)}
        self._parts.append(part)
        self._t = max(end_s, float(times[-1]))

    def recording(self) -> Recording:
        """Return everything that was taken."""
        settings = self._settings
        info = RecordingInfo(
            serial=settings.serial,
            model=settings.model,
            axes=settings.axes,
            kind="samples",
            started_at=self._clock.utc(),
            latitude_deg=self._bench.latitude_deg,
            sample_rate_hz=self._unit.sample_rate_hz,
            max_rate_dps=settings.max_rate_dps,
            technology=settings.technology or None,
            datasheet=settings.datasheet,
            notes=f"simulated: recipe {self._plan.recipe.name}, seed {self._seed()}",
        )
        columns = {name: np.concatenate([part[name] for part in self._parts]) for name in self._parts[0]}
        names = ("t_s", "run", "temperature_c", "chamber_c", "chamber_setpoint_c")
        rows = list(zip(*self._environment, strict=True))
        environment: Mapping[str, NDArray[Any]] = {
            name: np.asarray(values) for name, values in zip(names, rows, strict=True)
        }
        return Recording(info, columns, environment)

    def _seed(self) -> int:
        return self._bench.simulation.seed if self._bench.simulation else 1

"""Recordings made in the simulated world, with effects hidden in the unit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import Field

from instruments.bench_config import BenchFile, GyroSettings, SimulationSettings
from labctl.answers.base import LongText, Request, ResponseModel
from labctl.errors import BadInput
from labctl.recording import Recording, write_recording
from labctl.services.planning.loading import bench_for, limits_of, load_bench, load_recipe
from labctl.services.simulation.effect_sizes import USUAL_RATE_HZ, sizes_on_plan
from labctl.services.simulation.plan_simulation import simulate
from procedures.planning.plan import Plan, make_plan


class SimulateRequest(Request):
    """Which recipe on which simulated bench, and what is hidden in its gyro."""

    recipe: LongText
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
    made_recording = make_recording(request)
    write_recording(made_recording.recording, out, file_format)
    return SimulateResponse(
        serial=made_recording.recording.info.serial,
        datasets=len(np.unique(made_recording.recording.columns["dataset"])),
        readings=len(made_recording.recording),
        hidden=dict(made_recording.hidden), folder=str(out),
    )  # fmt: skip


def make_recording(request: SimulateRequest, serial: str | None = None) -> Made:
    """Simulate a campaign, the unit under another serial number if one is named.

    Raises BadInput, RecipeError, PlanRefused.
    """
    recipe = load_recipe(request.recipe)
    bench = load_bench(request.bench or bench_for(recipe))
    gyro = _gyro(bench, request.gyro)
    rate_hz = request.sample_rate_hz or USUAL_RATE_HZ
    gyro = gyro.model_copy(update={"sample_rate_hz": rate_hz, "serial": serial or gyro.serial})
    bench = bench.model_copy(update={"gyros": (gyro,)})
    plan = make_plan(recipe, limits_of(bench), clip=request.clip)
    hidden = sizes_on_plan(request.hide, plan, bench, gyro)
    simulation = (bench.simulation or SimulationSettings()).model_copy(update={"seed": request.seed, "hidden": hidden})
    bench = bench.model_copy(update={"simulation": simulation})
    return Made(simulate(plan, bench, gyro), plan, bench, hidden)


def _gyro(bench: BenchFile, name: str | None) -> GyroSettings:
    gyros = [gyro for gyro in bench.gyros if name in {None, gyro.name}]
    if not gyros:
        raise BadInput(f"bench {bench.name} has no gyro {name!r}; choose {', '.join(g.name for g in bench.gyros)}")
    return gyros[0]

"""Recordings to begin with: examples of real gyros that come with labctl, and simulated ones with hidden effects."""

from __future__ import annotations

from datetime import datetime
from importlib import resources
from pathlib import Path

from labctl.answers.recordings import SimulatedRecordingResponse, SimulatedRequest
from labctl.errors import BadInput
from labctl.services.recordings.inspection import inspect_stored
from labctl.services.recordings.transfer import model_for
from labctl.services.simulation.recordings import SimulateRequest, make_recording
from labctl.store import Store


def examples() -> dict[str, Path]:
    """Return the recordings that come with labctl, by name."""
    home = Path(str(resources.files("labctl"))) / "examples"
    return {folder.name: folder for folder in sorted(home.iterdir()) if (folder / "recording.toml").is_file()}


def example(name: str) -> Path:
    """Return an example's folder; raises BadInput naming those that there are."""
    shipped = examples()
    if name not in shipped:
        raise BadInput(f"no example {name!r} comes with labctl; choose one of {', '.join(shipped)}")
    return shipped[name]


def add_simulated(store: Store, request: SimulatedRequest, at: datetime) -> SimulatedRecordingResponse:
    """Make a recording in simulation and take it in. Raises BadInput, RecipeError, PlanRefused."""
    request_made = SimulateRequest(recipe=request.recipe, hide=request.hide, seed=request.seed, clip=request.clip)
    made_recording = make_recording(request_made, request.serial)
    recipe, bench, hidden = made_recording.plan.recipe.name, made_recording.bench.name, dict(made_recording.hidden)
    details = {"recipe": recipe, "bench": bench, "seed": request.seed, "hidden": hidden}
    number = store.recordings.add_import(made_recording.recording, at, details)
    row = store.recordings.get(number)
    return SimulatedRecordingResponse(
        serial=made_recording.recording.info.serial, recording=number, datasets=made_recording.plan.datasets,
        readings=len(made_recording.recording), suggested_model=model_for(store, row), recipe=recipe,
        bench=bench, seed=request.seed, hidden=hidden,
        warnings=inspect_stored(store, row, made_recording.recording).warnings,
    )  # fmt: skip

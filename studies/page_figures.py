"""Figures of the pages of three units, and the same from the database by a script that shares no code with them.

A real gyro (points), a campaign on one axis and a recording of three axes (readings). The pages show what their
answers over HTTP say, which browser tests compare; here these answers are compared with
`studies.page_figures_recomputed`.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from fastapi.testclient import TestClient

import procedures.recipe
from instruments.clock import VirtualClock
from labctl.answers.campaigns import StartRequest
from labctl.api.app import create_app
from labctl.services.campaigns.execution import run_here
from labctl.services.lab_service import LabService
from labctl.store import open_store
from studies.page_figures_recomputed import residuals_of, sets_of

RECIPES = Path(procedures.recipe.__file__).parent / "recipes"
#: Of the campaign: enough for a parabola.
TEMPERATURES = "temperatures_c = [15, 25, 35]"
#: Figure, its largest difference from what was recomputed, over the size of the quantity, and how many were compared.
Row = tuple[str, float, int]


def run() -> str:
    """Return the largest relative difference of each kind of figure, by unit."""
    with tempfile.TemporaryDirectory() as folder:
        lines = []
        for name, rows in units(Path(folder) / "lab.sqlite"):
            lines.append(f"   {name}:")
            lines += [f"      {figure:34} {worst:8.1e}   ({n} compared)" for figure, worst, n in rows]
        return "\n".join(lines)


def units(database: Path) -> Iterator[tuple[str, list[Row]]]:
    """Yield each unit with its figures; `database` is made."""
    recipe = (RECIPES / "short.toml").read_text(encoding="utf-8")
    run_here(str(database), StartRequest(recipe=re.sub("temperatures_c = .*", TEMPERATURES, recipe)))
    with (
        open_store(str(database), write=True) as store,
        TestClient(create_app(LabService(store, VirtualClock()))) as client,
    ):
        client.post("/api/recordings/example", json={"name": "osu-fog"}).raise_for_status()
        client.post("/api/recordings/simulated", json={"recipe": "quick-triaxial", "seed": 5}).raise_for_status()
        for head in client.get("/api/recordings").json():
            name = f"{head['serial']}, recording {head['id']} ({head['kind']})"
            yield name, list(compared(client, database, head["serial"], head["id"]))


def compared(client: TestClient, database: Path, serial: str, recording: int) -> Iterator[Row]:
    """Fit bias, scale factor and misalignment to a recording; yield what its pages show beside what was recomputed."""
    path = f"/api/units/{serial}/calibrations"
    asked = {"recording": recording, "model": "bias_scale"}
    version = client.post(path, json=asked).raise_for_status().json()["version"]
    sets = sets_of(database, recording)
    residuals = residuals_of(database, serial, version, sets)

    head = client.get(f"/api/recordings/{recording}").json()
    yield figure("data sets, readings", [head["datasets"], head["readings"]], [len(sets.number), sets.readings.sum()])
    answer = client.get(f"/api/recordings/{recording}/datasets").json()
    for kind, own in (("mean", sets.mean), ("std", sets.std)):
        shown = {name: each[kind] for name, each in answer["channels"].items() if name in own and any(each[kind])}
        if own and shown:
            names = sorted(name for name in shown if not name.startswith("chamber"))
            yield figure(
                f"{'mean' if kind == 'mean' else 'standard deviation'} of a data set",
                np.concatenate([shown[name] for name in names]), np.concatenate([own[name] for name in names]),
            )  # fmt: skip

    columns = client.get(f"{path}/{version}/comparison").json()["columns"]
    place = {int(number): k for k, number in enumerate(sets.number)}
    for name, which in (("measured_error_dps", 0), ("residual_dps", 1)):
        recomputed = [
            residuals[axis][which][place[n]] for axis, n in zip(columns["axis"], columns["dataset"], strict=True)
        ]
        yield figure(name.replace("_dps", "").replace("_", " "), columns[name], recomputed)

    fitted = client.get(f"{path}/{version}").json()
    error = fitted["error"]
    # what a fit takes off as the Earth's rate that goes round with the table is no part of the model
    names = [("raw_rms_dps", 0)] + [("rms_dps", 1)] * ("once_per_turn_dps" not in fitted["environment"])
    for name, which in names:
        rms = np.sqrt(np.mean(np.concatenate([each[which] for each in residuals.values()]) ** 2))
        yield figure(name.replace("_dps", "").replace("_", " "), [error[name]], [rms])
    criticism = client.get(f"{path}/{version}/criticism").json()
    yield from where(criticism["where"], sets, residuals)


def where(shown: list[dict[str, Any]], sets: Any, residuals: dict[str, Any]) -> Iterator[Row]:
    """Yield the RMS of the residual in each part of a channel that the page names."""
    own, said = [], []
    for part in shown:
        values = {"table_rate_dps": sets.table_rate_dps, "temperature_c": sets.temperature_c}.get(part["channel"])
        if values is None:
            continue
        inside = (values >= part["from"]) & (values <= part["to"])
        own.append(float(np.sqrt(np.mean(residuals[part["axis"]][1][inside] ** 2))))
        said.append(part["rms_dps"])
    if said:
        yield figure("RMS where the error is largest", said, own)


def figure(name: str, shown: Any, own: Any) -> Row:
    """Return the largest difference over the largest size of a quantity."""
    first, second = np.asarray(shown, dtype=float), np.asarray(own, dtype=float)
    size = float(np.abs(second).max()) or 1.0
    return name, float(np.abs(first - second).max()) / size, first.size


if __name__ == "__main__":
    print(run())

"""Figures of the pages of three units, and the same from the database by a script that shares no code with them.

A real gyro (points), a campaign on one axis and a recording of three axes (readings); of a fourth, a campaign that ends
when U is small enough, U at its end. The pages show what their answers over HTTP say, which browser tests compare; here
these answers are compared with what `studies.page_figures_recomputed`, `_refit`, `_surface`, `_left`, `_lack`,
`_evidence`, `_formulas`, `_allan`, `_budget` and `_any_axis` compute.

Taken from the answers, and so not recomputed: the bins of the picture of an inspection. Compared beside an adequate
model alone: the test of the lack of fit, and the evidence for effects of a few shapes and the odds between them. Not
compared: what an Allan deviation shows beside white noise.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from fastapi.testclient import TestClient

import procedures.recipe
from instruments.clock import VirtualClock
from labctl.answers.campaigns import StartRequest
from labctl.api.app import create_app
from labctl.services.campaigns.execution import run_here
from labctl.services.lab_service import LabService
from labctl.store import open_store
from studies.page_figures_explore import explore_page
from studies.page_figures_fit import fit_of_version
from studies.page_figures_pages import Compared, Row, campaign_page, recording_page
from studies.page_figures_stop import stopped_campaign
from studies.page_figures_unit import unit_page
from studies.page_figures_use import use_page

RECIPES = Path(procedures.recipe.__file__).parent / "recipes"
#: Of the campaign: enough temperatures for a parabola, and readings for an Allan deviation.
CHANGED = {
    "temperatures_c = .*": "temperatures_c = [15, 25, 35]",
    "hold_s = .*": "hold_s = 1800",
    "duration_s = .*": "duration_s = 40",
}


def run() -> str:
    """Return the largest relative difference of each kind of figure, by unit."""
    with tempfile.TemporaryDirectory() as folder:
        lines = []
        for name, rows in units(Path(folder) / "lab.sqlite"):
            lines.append(f"   {name}:")
            lines += [
                f"      {figure:42} {worst:8.1e} of {allowed:8.1e} allowed   ({n} compared)"
                for figure, worst, n, allowed in rows
            ]
        return "\n".join(lines)


def units(database: Path) -> Iterator[tuple[str, list[Row]]]:
    """Yield each unit with its figures; `database` is made."""
    recipe = (RECIPES / "short.toml").read_text(encoding="utf-8")
    for line, changed in CHANGED.items():
        recipe = re.sub(line, changed, recipe)
    run_here(str(database), StartRequest(recipe=recipe))
    with (
        open_store(str(database), write=True) as store,
        TestClient(create_app(LabService(store, VirtualClock()))) as client,
    ):
        client.post("/api/recordings/example", json={"name": "osu-fog"}).raise_for_status()
        client.post("/api/recordings/simulated", json={"recipe": "quick-triaxial", "seed": 5}).raise_for_status()
        for head in client.get("/api/recordings").json():
            name = f"{head['serial']}, recording {head['id']} ({head['kind']})"
            yield name, compared(client, database, head["serial"], head["id"])
    yield "a campaign that ends early", list(stopped_campaign(database.with_name("stopped.sqlite")))


def compared(client: TestClient, database: Path, serial: str, recording: int) -> list[Row]:
    """Fit bias, scale factor and misalignment to a recording; return each kind of figure of its pages once."""

    def get(path: str) -> Any:
        return client.get(path).raise_for_status().json()

    asked = {"recording": recording, "model": "bias_scale"}
    made = client.post(f"/api/units/{serial}/calibrations", json=asked).raise_for_status().json()
    unit = Compared.of(get, database, serial, recording, made["version"])
    rows = [*recording_page(unit), *explore_page(unit), *unit_page(unit), *fit_of_version(unit), *use_page(unit)]
    campaign = get(f"/api/recordings/{recording}")["campaign"]
    if campaign is not None:
        rows += campaign_page(unit, campaign)
    known = [row for row in rows if row.n]  # what is unknown to both has no figure
    return [
        together(name, [row for row in known if row.figure == name])
        for name in dict.fromkeys(row.figure for row in known)
    ]


def together(name: str, rows: list[Row]) -> Row:
    """Return rows of one kind of figure as one."""
    return Row(name, max(row.worst for row in rows), sum(row.n for row in rows), max(row.allowed for row in rows))


if __name__ == "__main__":
    print(run())

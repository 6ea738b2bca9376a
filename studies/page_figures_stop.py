"""U of a campaign that ends when it is small enough, as its page shows it, beside the same that was recomputed."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from fastapi.testclient import TestClient

from instruments.clock import VirtualClock
from labctl.answers.campaigns import StartRequest
from labctl.api.app import create_app
from labctl.services.campaigns.execution import run_here
from labctl.services.lab_service import LabService
from labctl.store import open_store
from studies.page_figures_pages import Compared, Row, figure
from studies.page_figures_use import FIVE_DIGITS_LESS_NOISE, unit_in_use

RATES_DPS = (-20.0, 20.0)
RECIPE = """
format = "labctl-recipe/1"
name = "until-enough"
temperatures_c = [22, 24, 26, 28, 30, 32, 34]
rates_dps = [-20, -10, 0, 10, 20]
positions = ["z"]
temperature_order = "up_down"
rate_order = "random"

[soak]
hold_s = 120
max_drift_c = 1.0
drift_window_s = 60

[acquire]
duration_s = 10
settle_s = 2

[fit]
model = "bias_scale"

[stop]
u_dps = 0.012
"""


def stopped_campaign(database: Path) -> Iterator[Row]:
    """Run a campaign that ends when U is small enough, and yield U at its end; `database` is made."""
    run_here(str(database), StartRequest(recipe=RECIPE))
    with (
        open_store(str(database), write=True) as store,
        TestClient(create_app(LabService(store, VirtualClock()))) as client,
    ):

        def get(path: str) -> Any:
            return client.get(path).raise_for_status().json()

        (head,) = client.get("/api/recordings").json()
        asked = {"recording": head["id"], "model": "bias_scale"}
        made = client.post(f"/api/units/{head['serial']}/calibrations", json=asked).raise_for_status().json()
        c = Compared.of(get, database, head["serial"], head["id"], made["version"])
        (course,) = c.get(f"/api/campaigns/{head['campaign']}/uncertainty")["units"].values()
        assert course["known"][-1] == "of the fit"
        yield figure("data sets of a campaign that ends early", course["datasets"][-1:], [len(c.sets.number)])
        yield figure("U of a campaign that ends early", course["u_dps"][-1:], [_largest(c)], FIVE_DIGITS_LESS_NOISE)


def _largest(c: Compared) -> float:
    """Return the largest U of the output about its own axis over the rates of the recipe and its temperatures."""
    unit, warm = unit_in_use(c), (c.sets.temperature_c.min(), c.sets.temperature_c.max())
    (axis,) = c.law.axes
    own = np.array([each == axis for each in "xyz"], dtype=float)
    return max(
        unit.expanded(rate * own, temperature_c, aligned=False)[0]
        for temperature_c in np.linspace(*warm, 3).tolist()
        for rate in np.linspace(*RATES_DPS, 5).tolist()
    )

"""What the pages show of three units is what the database holds, by a script that shares no code with them."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from fastapi.testclient import TestClient

from instruments.clock import VirtualClock
from labctl.api.app import create_app
from labctl.services.lab_service import LabService
from labctl.store import open_store
from studies.page_figures import units

#: Rates are computed here and there in another order; the table's rates are written with 12 digits.
LARGEST = 1e-7


@pytest.fixture(scope="module")
def compared(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[tuple[str, float, int]]]:
    return dict(units(tmp_path_factory.mktemp("figures") / "lab.sqlite"))


@pytest.mark.slow
def test_figures_of_three_units_are_those_of_the_database(
    compared: dict[str, list[tuple[str, float, int]]],
) -> None:
    assert len(compared) == 3
    for unit, rows in compared.items():
        for figure, worst, n in rows:
            assert n > 0
            assert worst < LARGEST, f"{unit}: {figure}"
    assert sum(n for rows in compared.values() for _, _, n in rows) > 3000


@pytest.mark.slow
def test_no_kind_of_figure_is_left_out(compared: dict[str, list[tuple[str, float, int]]]) -> None:
    kinds = {figure for rows in compared.values() for figure, _, _ in rows}
    assert kinds == {
        "data sets, readings", "mean of a data set", "standard deviation of a data set", "measured error", "residual",
        "raw rms", "rms", "RMS where the error is largest",
    }  # fmt: skip


@pytest.mark.slow
def test_compare_says_what_part_of_the_earth_s_rate_its_errors_contain(tmp_path: Path) -> None:
    """The latitude of the simulated bench is 42.28 deg; a sidereal day has 86,164.1 s."""
    with (
        open_store(str(tmp_path / "lab.sqlite"), write=True) as store,
        TestClient(create_app(LabService(store, VirtualClock()))) as client,
    ):
        found = {}
        for serial, path, asked in (
            ("STIM-0001", "simulated", {"recipe": "quick-triaxial"}),
            ("OSU-FOG-2024", "example", {"name": "osu-fog"}),
        ):
            client.post(f"/api/recordings/{path}", json=asked).raise_for_status()
            client.post(f"/api/units/{serial}/calibrations", json={"model": "bias_scale"}).raise_for_status()
            answer = client.get(f"/api/units/{serial}/calibrations/1/comparison").json()
            found[serial] = answer["earth_turning_dps"]
    horizontal_dps = 360 / 86_164.1 * math.cos(math.radians(42.28))
    assert found == {"STIM-0001": pytest.approx(horizontal_dps, rel=1e-5), "OSU-FOG-2024": None}

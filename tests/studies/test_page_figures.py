"""What the pages show of three units is what the database holds, by a script that shares no code with them."""

from __future__ import annotations

import ast
import math
from pathlib import Path

import numpy as np
import pytest
from fastapi.testclient import TestClient
from scipy.special import chdtrc, fdtrc

from instruments.clock import VirtualClock
from labctl.api.app import create_app
from labctl.services.lab_service import LabService
from labctl.store import open_store
from studies.page_figures import units
from studies.page_figures_any_axis import Part, normal_k
from studies.page_figures_lack import chance_above
from studies.page_figures_pages import Row, figure
from studies.page_figures_surface import f_above

#: No figure has fewer digits than this allows.
LEAST_DIGITS = 1e-3

#: The kinds of figures of the pages, by where they are.
KINDS = {
    "recording": {
        "data sets, readings", "number, rate and readings of data sets", "mean of a data set",
        "standard deviation of a data set", "begin and end of a data set", "readings of a data set", "trace over all",
        "time of a trace over all", "trace within a data set", "time of a trace within a data set",
        "picture of the inspection", "Allan deviation", "which readings share a bin", "interval of an Allan deviation",
        "fitted curve of an Allan deviation", "angle random walk and its u, deg/sqrt(h)", "bounds of N, B and K",
    },
    "explore": {
        "rate and temperature of a point", "measured error", "residual without refitting", "modelled error",
        "which data sets share a level",
        "levels of rate and temperature", "error of a full turn", "lines of the model", "Earth's rate once per turn",
        "residual map", "rates and temperatures of the map", "which data sets share a cell of the map",
        "levels of the map", "noise floor of a mean, from the map",
        "residual against channels", "channels of the residual", "RMS residual of the fitted model",
        "RMS where the error is largest", "RMS, largest and mean error of a version", "data sets furthest off",
    },
    "unit": {
        "RMS error without a correction", "RMS error of a version", "coefficients", "u of coefficients",
        "u of the coefficients in use", "contributions in use", "combined and expanded uncertainty",
        "bias left by a version", "u of bias and scale factor left", "data sheet: bias", "data sheet: scale factor",
        "data sheet: scale factor asymmetry", "data sheet: scale factor nonlinearity", "data sheet: bias temperature",
        "data sheet: scale factor temperature", "data sheet: angle random walk", "data sheet: bounds of N, B and K",
        "data sheet: misalignment and orthogonality", "u of a reference standard",
        "sensitivity of a reference standard", "contribution of a reference standard",
        "repeatability by the data sheet",
        "effective degrees of freedom", "coverage factor", "scale factor left by a version, over its u",
    },
    "fit": {
        "coefficients by a refit, of their u", "u of coefficients by a refit, over another",
        "RMS error at temperatures left out", "white noise of a mean", "drift in the noise floor",
        "noise in proportion to the rate", "longest time constant of the drift", "drift over that of the data sheet",
        "noise floor", "noise floor by near repeats", "residual variance over that of noise and drift",
        "chance that noise leaves as much", "evidence for an effect", "odds between two effects",
    },
    "use": {
        "calibrated temperatures", "calibrated rates", "model in use", "repeatability between runs",
        "degrees of freedom between runs", "reach of U about any axis", "U about any axis",
        "U about any axis, up to a rotation",
    },
    "stop": {"data sets of a campaign that ends early", "U of a campaign that ends early"},
    "campaign": {
        "samples of the course", "course of a campaign", "begin and end of a step", "channels of a campaign",
    },
}  # fmt: skip
#: What recomputes the figures may import these modules and each other.
ALONE = {
    "__future__", "blosc2", "collections.abc", "dataclasses", "functools", "itertools", "json", "math", "numpy",
    "pathlib", "sqlite3", "struct", "typing",
}  # fmt: skip
#: What recomputes the figures.
RECOMPUTING = {f"page_figures_{each}" for each in (
    "allan", "any_axis", "budget", "evidence", "formulas", "lack", "left", "recomputed", "refit", "surface",
)}  # fmt: skip


@pytest.fixture(scope="module")
def compared(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[Row]]:
    return dict(units(tmp_path_factory.mktemp("figures") / "lab.sqlite"))


@pytest.mark.slow
def test_figures_of_three_units_are_those_of_the_database(compared: dict[str, list[Row]]) -> None:
    assert len(compared) == 4
    for unit, rows in compared.items():
        for row in rows:
            assert row.n > 0, f"{unit}: {row.figure}"
            assert row.worst <= row.allowed <= LEAST_DIGITS, f"{unit}: {row.figure}"
    assert sum(row.n for rows in compared.values() for row in rows) > 40_000


@pytest.mark.slow
def test_no_kind_of_figure_is_left_out(compared: dict[str, list[Row]]) -> None:
    kinds = {row.figure for rows in compared.values() for row in rows}
    assert kinds == set().union(*KINDS.values())


def test_a_figure_that_is_wrong_or_missing_is_noticed() -> None:
    assert figure("a", [1.0, None], [1.0, np.nan]).worst == 0.0
    assert figure("a", [1.0, 2.0], [1.0, 2.0002]).worst == pytest.approx(1e-4, rel=1e-3)
    for shown in ([1.0], [1.0, None]):
        with pytest.raises(AssertionError, match="a: "):
            figure("a", shown, [1.0, 2.0])


def test_distributions_that_are_written_by_series_are_those_of_scipy() -> None:
    for chi2, freedom in ((3.0, 2), (1461.0, 1668), (1800.0, 1668), (5.0, 60)):
        assert chance_above(chi2, freedom) == pytest.approx(chdtrc(freedom, chi2), rel=1e-9)
    for ratio, above, below in ((1.3, 4, 38), (6.0, 5, 37), (0.2, 9, 12)):
        assert f_above(ratio, above, below) == pytest.approx(fdtrc(above, below, ratio), rel=1e-6)
    tilts = [Part((1.0, 1.0), "rectangular")]
    for tilt, k in ((tilts, math.sqrt(6) * (1 - math.sqrt(1 - 0.9545))), ([Part((1.0,))], 2.0)):
        assert normal_k([*tilt, Part((0.05,))]) == pytest.approx(k, abs=0.005)


@pytest.mark.parametrize("module", sorted(RECOMPUTING))
def test_what_is_recomputed_shares_no_code_with_the_pages(module: str) -> None:
    tree = ast.parse(Path(f"studies/{module}.py").read_text(encoding="utf-8"))
    imported = {each.name for node in ast.walk(tree) if isinstance(node, ast.Import) for each in node.names}
    imported |= {node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    assert imported <= ALONE | {f"studies.{each}" for each in RECOMPUTING}


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

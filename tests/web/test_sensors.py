"""The page of a unit shows its accelerometer and magnetometer with their alignment, and gives each as a file."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from scipy import stats
from typer.testing import CliRunner

from labctl.cli.app import app
from labctl.services.accelerometer import Source, accelerometer_of_files
from labctl.services.sensor_exports import export_of
from labctl.services.sensor_versions import measured_data
from tests.helpers.browser import Service
from tests.helpers.poses_at_rest import poses, readings_in, write_readings
from tests.helpers.turned_triads import unit_of, write_turned

if TYPE_CHECKING:
    from playwright.sync_api import Page


#: A cell such as (-1.23 ± 0.45) × 10⁻⁵ g.
CELL = re.compile(r"\(?([-−]?[\d.]+) ± ([\d.]+)\)?(?: × 10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+))? ?(\S*)")
RAISED = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")


def parsed(cell: str) -> tuple[float, float, float, str]:
    """Return value, expanded uncertainty, half of the last digit that is written, and the unit."""
    found = CELL.fullmatch(cell.strip().replace("\xa0", " "))
    assert found is not None, cell
    value, expanded, power, unit = found.groups()
    factor = 10.0 ** int((power or "0").translate(RAISED))
    decimals = len(value.partition(".")[2])
    return float(value.replace("−", "-")) * factor, float(expanded) * factor, 0.5 * factor * 10.0**-decimals, unit


def rows_of(page: Page, name: str) -> dict[str, tuple[float, float, float, str]]:
    """Return the coefficients that the page shows of a version."""
    rows = page.get_by_role("group", name=name, exact=True).locator("tbody tr")
    rows.first.wait_for()
    cells = [rows.nth(place).locator("td").all_inner_texts() for place in range(rows.count())]
    return {first: parsed(second) for first, second in cells}


@pytest.mark.slow
def test_the_coefficients_and_the_alignment_of_the_page_are_those_of_the_command(
    service: Service, visit: Callable[[str], Page], tmp_path: Path
) -> None:
    folder = write_turned(tmp_path / "turned", unit_of(11), 20)
    database = str(service.folder / "lab.sqlite")
    given = {}
    for sensor in ("accelerometer", "magnetometer"):
        run = CliRunner().invoke(app, [sensor, str(folder), "--json", "--database", database])
        given[sensor] = json.loads(run.stdout)
        data = measured_data([folder], "a recording in poses").model_dump(mode="json")
        service.post(f"/api/units/TRIADS-1/sensors/{sensor}", {"data": data, "result": given[sensor], "by": "Ada"})
    page = visit("/units/TRIADS-1")
    force, field = rows_of(page, "Accelerometer, version 1"), rows_of(page, "Magnetometer, version 1")
    expected = {
        **{f"bias {a}": (force, given["accelerometer"]["bias_g"][a], "g") for a in "xyz"},
        "misalignment yz": (force, given["accelerometer"]["misalignment"]["yz"], "mrad"),
        **{f"hard iron {a}": (field, given["magnetometer"]["hard_iron_ut"][a], "uT") for a in "xyz"},
        "soft iron xz": (field, given["magnetometer"]["soft_iron"]["xz"], ""),
        **{f"gyro triad about {a}": (force, given["accelerometer"]["alignment"]["axes"][a], "deg") for a in "xyz"},
        **{f"magnetometer about {a}": (field, given["magnetometer"]["alignment"]["axes"][a], "deg") for a in "xyz"},
        "dip of the field": (field, given["magnetometer"]["alignment"]["dip"], "deg"),
    }
    assert (len(force), len(field)) == (12, 14)
    for name, (shown, true, unit) in expected.items():
        value, expanded, half, unit_shown = shown[name]
        assert unit_shown.replace("µ", "u").replace("°", "deg") == unit, name
        if unit == "mrad":
            value, expanded, half = (1e-3 * figure for figure in (value, expanded, half))
        assert abs(value - true["value"]) <= 1.001 * half, name
        of_command = true.get("expanded", stats.t.ppf(0.97725, true.get("degrees_of_freedom") or 1e9) * true["u"])
        assert abs(expanded - of_command) <= 1.001 * half, name


def test_a_version_is_on_the_page_of_its_unit(service: Service, visit: Callable[[str], Page], tmp_path: Path) -> None:
    path = Path(write_readings(tmp_path / "march.csv", readings_in(poses(26, 1), 1)))
    result = accelerometer_of_files([path], Source())
    data = measured_data([path], Source().text).model_dump(mode="json")
    body = {"data": data, "result": result.model_dump(mode="json"), "by": "Ada"}
    service.post("/api/units/IMU-7/sensors/accelerometer", body)
    page = visit("/units/IMU-7")
    row = page.get_by_role("group", name="Versions of accelerometer and magnetometer").locator("tbody tr")
    text = row.inner_text()
    for said in ("accelerometer", "adequate", "Ada", "march.csv"):
        assert said in text
    with page.expect_download() as got:
        row.get_by_role("button", name="PX4 parameters").click()
    assert got.value.suggested_filename == "IMU-7-accelerometer-v1.params"
    assert Path(got.value.path()).read_text(encoding="utf-8") == export_of(result, "px4")

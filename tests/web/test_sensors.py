"""The page of a unit shows the versions of its accelerometer and magnetometer, and gives each as a file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from labctl.services.accelerometer import Source, accelerometer_of_files
from labctl.services.sensor_exports import export_of
from labctl.services.sensor_versions import measured_data
from tests.helpers.browser import Service
from tests.helpers.poses_at_rest import poses, readings_in, write_readings

if TYPE_CHECKING:
    from playwright.sync_api import Page

pytestmark = pytest.mark.timeout(300)


def test_a_version_is_on_the_page_of_its_unit(service: Service, visit: Callable[[str], Page], tmp_path: Path) -> None:
    path = Path(write_readings(tmp_path / "march.csv", readings_in(poses(26, 1), 1)))
    result = accelerometer_of_files([path], Source())
    data = measured_data([path], Source().text).model_dump(mode="json")
    body = {"data": data, "result": result.model_dump(mode="json"), "by": "Ada"}
    service.post("/api/units/IMU-7/sensors/accelerometer", body)
    page = visit("/units/IMU-7")
    row = page.get_by_role("region", name="Versions of accelerometer and magnetometer").locator("tbody tr")
    text = row.inner_text()
    for said in ("accelerometer", "adequate", "Ada", "march.csv"):
        assert said in text
    with page.expect_download() as got:
        row.get_by_role("button", name="PX4 parameters").click()
    assert got.value.suggested_filename == "IMU-7-accelerometer-v1.params"
    assert Path(got.value.path()).read_text(encoding="utf-8") == export_of(result, "px4")

"""Units at the end of a column's name, and dates in a column of their own."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from labctl.errors import BadFile
from labctl.recording import Recording
from labctl.recording.column_map.names import name_says
from labctl.recording.column_map.units import find_unit, unit_of_target
from labctl.services.recordings.importers import read_with

BEGIN = datetime(2026, 3, 14, 23, 59, 50, tzinfo=UTC)


@pytest.mark.parametrize(
    ("name", "target", "factor"),
    [
        ("temp_mC", "temperature_c", 1e-3),
        ("temp_cdegC", "temperature_c", 1e-2),
        ("gyro_x_mdps", "gyro_x", 1e-3),
        ("gyro_y_dph", "gyro_y", 1 / 3600),
        ("gyro_z_rad_per_s", "gyro_z", 180 / np.pi),
        ("gyro_z_mrad_s", "gyro_z", 0.18 / np.pi),
        ("gz_rpm", "gyro_z", 6.0),
        ("t_us", "t_s", 1e-6),
        ("t_min", "t_s", 60.0),
        ("accel_z_mg", "accel_z_g", 1e-3),
        ("accel_x_ug", "accel_x_g", 1e-6),
        ("ay_mps2", "accel_y_g", 1 / 9.80665),
        ("az_m_s2", "accel_z_g", 1 / 9.80665),
        ("mag_x_nT", "field_x_ut", 1e-3),
        ("vdd_mV", "supply_v", 1e-3),
        ("gyro_dps[1]", "gyro_y", 1.0),
        ("gyro_mdps_z", "gyro_z", 1e-3),
        ("T_degF", "temperature_c", 5 / 9),
    ],
)
def test_a_name_says_its_unit(name: str, target: str, factor: float) -> None:
    says = name_says(name)
    assert says.target == target
    unit = find_unit(unit_of_target(target), says.unit)
    assert unit is not None
    assert unit.factor == pytest.approx(factor, rel=1e-12)


@pytest.mark.parametrize("name", ["temp_min", "temp_mV", "gyro_x_min", "accel_x_h"])
def test_a_unit_of_another_quantity_is_none(name: str) -> None:
    assert name_says(name).target == ""


def imported(tmp_path: Path, day: str, clock: str, begin: datetime = BEGIN) -> Recording:
    rng = np.random.default_rng(2)
    lines = ["Date,Time,gyro_z_mdps,temp_mC"]
    for k in range(300):
        at = begin + timedelta(milliseconds=100 * k)
        lines.append(f"{at:{day}},{format(at, clock)[:-3]},{300 + 50 * rng.normal():.2f},{25000 + k}")
    path = tmp_path / "bench.csv"
    path.write_text("\n".join(lines) + "\n")
    return read_with("text", path, {})


@pytest.mark.parametrize("day", ["%Y-%m-%d", "%d/%m/%Y", "%m/%d/%Y", "%d.%m.%Y", "%Y/%m/%d"])
def test_a_date_beside_a_time_of_day_dates_the_readings(day: str, tmp_path: Path) -> None:
    found = imported(tmp_path, day, "%H:%M:%S.%f")
    assert found.info.started_at == BEGIN
    assert found.info.date_known
    assert np.diff(found.columns["t_s"]) == pytest.approx(0.1)  # over midnight
    assert float(np.mean(found.gyro_dps("z"))) == pytest.approx(0.3, abs=0.02)
    assert float(np.asarray(found.columns["temperature_c"])[0]) == 25.0


def test_a_day_that_may_be_a_month_is_refused_with_what_to_write(tmp_path: Path) -> None:
    with pytest.raises(BadFile, match="day first or the month first; write unit = 'date-time d/m/y'"):
        imported(tmp_path, "%d/%m/%Y", "%H:%M:%S.%f", datetime(2026, 3, 4, 10, tzinfo=UTC))

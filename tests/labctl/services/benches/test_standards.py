"""Standards of a bench: what its instruments' settings say counts where no certificate is stated."""

from __future__ import annotations

from datetime import date
from typing import Any

import pytest

from instruments.bench_config import BenchFile, read_bench
from instruments.standards import MEASURED_STEP_CLOCK
from labctl.services.benches.standards import CLOCK_SETTING, overdue_events, standards_of
from labctl.services.planning.loading import with_drivers


def bench_with(standards: list[dict[str, Any]], **table: Any) -> BenchFile:
    record = read_bench("single-axis-sim").model_dump(exclude_none=True)
    return with_drivers(
        BenchFile.model_validate({**record, "table": {**record["table"], **table}, "standards": standards})
    )


def test_the_step_clock_counts_by_its_setting_until_a_certificate_is_stated() -> None:
    (found,) = standards_of(bench_with([]))
    assert (found.name, found.quantity, found.standard_u) == (CLOCK_SETTING, "clock", 50.0)
    (found,) = standards_of(bench_with([], clock_u_ppm=20.0))
    assert found.standard_u == 20.0
    (found,) = standards_of(bench_with([{"quantity": "clock", "u": 2.0}], clock_u_ppm=20.0))
    assert (found.name, found.standard_u) == ("", 2.0)


def test_a_measured_step_clock_is_known_from_the_replies_and_the_computers_clock_is_not_stated() -> None:
    (found,) = standards_of(bench_with([], clock_run_s=60.0, reply_u_s=0.001))
    assert (found.name, found.quantity, found.unit_name) == (MEASURED_STEP_CLOCK, "table_rate", "ppm")
    assert (found.standard_u, found.freedom) == (pytest.approx(23.6, rel=0.01), 2)  # of four runs, two of them longer


def test_the_reference_thermometer_is_a_standard() -> None:
    record = read_bench("single-axis-sim").model_dump(exclude_none=True)
    reference = {
        "driver": "fluke-1524", "name": "probe", "u_c": 0.02, "is_temperature": True, "certificate": "C-7",
    }  # fmt: skip
    found = standards_of(BenchFile.model_validate({**record, "standards": [], "references": [reference]}))
    assert [(each.quantity, each.name, each.standard_u, each.certificate) for each in found] == [
        ("thermometer", "probe", 0.02, "C-7")
    ]


def test_a_standard_past_its_due_date_is_a_warning() -> None:
    standards = bench_with([{"quantity": "clock", "u": 2.0, "name": "counter", "due": "2026-01-31"}]).standards
    assert overdue_events(standards, date(2026, 1, 31)) == ()
    (event,) = overdue_events(standards, date(2026, 2, 10))
    assert (event.level, event.device, event.value, event.unit) == ("warning", "clock", 10.0, "d")
    assert event.message.startswith("standard clock (counter) was due on 2026-01-31, 10 days ago; have it calibrated")

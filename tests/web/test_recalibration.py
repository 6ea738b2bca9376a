"""A unit that ages, calibrated once a year: as found, as left and its drift, on every way that leads to them."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from instruments.bench_config import shipped_benches
from tests.helpers.browser import Service, on_page, settled
from tests.helpers.certifying import OVERRIDE_OPTIONS
from tests.helpers.drafted_recipe import DRAFTED
from tests.helpers.lab import Lab

if TYPE_CHECKING:
    from playwright.sync_api import Page

UNIT = "FOG-0001"
YEARS = (2026, 2027, 2028)
BIAS_DPS_PER_YEAR, SCALE_FACTOR_PER_YEAR = 0.1, 2e-3
LAW = f"""
[simulation.units.fog.ageing]
bias_dps_per_year = {BIAS_DPS_PER_YEAR}
scale_factor_per_year = {SCALE_FACTOR_PER_YEAR}
since = 2026-01-01
"""


@pytest.fixture(scope="module")
def years(tmp_path_factory: pytest.TempPathFactory) -> Lab:
    """Return a lab in which one unit was calibrated in three years, and its first version put in force."""
    lab = Lab(tmp_path_factory.mktemp("years"))
    bench, recipe = lab.folder / "ageing.toml", lab.folder / "yearly.toml"
    bench.write_text(shipped_benches()["single-axis-sim"].read_text(encoding="utf-8") + LAW)
    recipe.write_text(DRAFTED)
    for year in YEARS:
        start = f"{year}-01-05T08:00Z"
        lab.run("campaign", "start", str(recipe), "--bench", str(bench), "--simulated-start", start)
        if year == YEARS[0]:
            lab.run("certify", UNIT, "1", "--by", "A. Person", *OVERRIDE_OPTIONS)
    return lab


@pytest.fixture
def tmp_path(tmp_path: Path, years: Lab) -> Path:
    """Give the service a copy of the laboratory's database."""
    for part in years.folder.glob("lab.sqlite*"):
        shutil.copy(part, tmp_path)
    return tmp_path


def within(figure: dict[str, Any], truth: float) -> bool:
    """Return whether a drift is known, and its interval holds what was put into the unit."""
    return bool(figure["u"] is not None and figure["low"] < truth < figure["high"])


@pytest.mark.slow
def test_a_year_later_the_draft_states_what_was_found_left_and_changed(years: Lab) -> None:
    before, after, last = (years.json("campaign", "status", str(number)) for number in (1, 2, 3))
    assert [each["started_at"][:10] for each in (before, after, last)] == [f"{year}-01-05" for year in YEARS]
    assert before["drafts"][0]["report"]["as_found"] is None
    draft = after["drafts"][0]
    assert draft["at"][:10] == f"{YEARS[1]}-01-05"  # not before it was measured
    report = draft["report"]
    assert report["as_found"]["version"] == report["drift"]["version"] == 1
    assert report["as_found"]["rms_dps"] > 5 * report["as_left"]["rms_dps"]
    changes = {each["coefficient"]: each for each in report["drift"]["coefficients"]}
    for name, truth in (("bias", BIAS_DPS_PER_YEAR), ("scale_factor", SCALE_FACTOR_PER_YEAR)):
        change = changes[name]
        assert abs(change["change"] - truth * 365 / 365.25) < 3 * change["u"], name
        assert change["significant"]
    assert [each["passed"] for each in report["limits"]] == [False]


@pytest.mark.slow
def test_the_trend_covers_the_ageing_on_the_command_line_over_http_and_on_the_page(
    years: Lab, service: Service, visit: Callable[..., Page]
) -> None:
    from playwright.sync_api import expect

    found = years.json("trend", UNIT)
    assert [point["at"][:4] for point in found["points"]] == [str(year) for year in YEARS]
    drifts = {(each["axis"], each["what"]): each for each in found["drifts"]}
    assert within(drifts["z", "bias"], BIAS_DPS_PER_YEAR)
    assert within(drifts["z", "scale_factor"], SCALE_FACTOR_PER_YEAR)
    assert drifts["z", "bias"]["significant"]
    assert service.get(f"/api/units/{UNIT}/trend") == found

    page = visit(f"/units/{UNIT}")
    card = page.get_by_role("region", name="Over the years")
    for line in found["text"]:
        expect(card.get_by_text(on_page(line).replace("scale_factor", "scale factor"))).to_be_visible()
    page.goto(f"{service.url}/campaigns/2")
    settled(page)
    expect(page.get_by_text("As found (version 1)").first).to_be_visible()
    expect(page.get_by_text("As left (version 2)").first).to_be_visible()


@pytest.mark.slow
def test_another_year_is_another_noise_and_the_same_year_the_same(years: Lab) -> None:
    first, second = (years.json("trend", UNIT)["points"][number]["as_left"]["rms_dps"] for number in (0, 1))
    assert first != second
    again = Lab(years.folder / "again")
    again.folder.mkdir()
    files = [str(years.folder / name) for name in ("yearly.toml", "ageing.toml")]
    again.run("campaign", "start", files[0], "--bench", files[1], "--simulated-start", "2026-01-05T08:00Z")
    assert again.json("trend", UNIT)["points"][0]["as_left"]["rms_dps"] == first

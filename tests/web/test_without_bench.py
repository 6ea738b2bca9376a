"""The pages of a service without a bench, with the example of a real gyro: what cannot be done is said before."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from labctl.texts import NO_BENCH
from tests.helpers.browser import NARROW, Faults, Service, figure, settled
from tests.helpers.certifying import OVERRIDE

if TYPE_CHECKING:
    from playwright.sync_api import Page

UNIT = "OSU-FOG-2024"
VERSIONS = f"/api/units/{UNIT}/calibrations"
SCREEN = {"width": 1440, "height": 900}


def prepared(service: Service) -> None:
    """Import the example, fit it, add what is missing, and certify that version."""
    service.post("/api/recordings/example", {"name": "osu-fog"})
    service.post(VERSIONS, {"model": "bias_scale"})
    service.post(f"{VERSIONS}/1/improve", {"add": ["sine_response"]})
    service.post(f"{VERSIONS}/2/certify", {"by": "Ann", **OVERRIDE})


@pytest.fixture(scope="module")
def template(furnish: Callable[..., Path]) -> Path:
    return furnish(prepared)


@pytest.fixture
def service(tmp_path: Path, template: Path) -> Iterator[Service]:
    shutil.copytree(template, tmp_path, dirs_exist_ok=True)
    serving = Service(tmp_path, bench=None)
    serving.start()
    yield serving
    serving.stop()


def test_what_a_certificate_lacks_is_said_before_it_is_asked_for(visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    page = visit(f"/units/{UNIT}", size=SCREEN)
    certificate = page.get_by_role("group", name="Certificate of version 2")
    expect(certificate).to_contain_text("No certificate can be issued. Missing: reference standards")
    expect(certificate).to_contain_text("the order of a certificate cannot state it")
    expect(page.get_by_role("button", name="Issue certificate")).to_have_count(0)
    row = page.get_by_role("row").filter(has=page.get_by_role("button", name="Certify"))
    row.get_by_text("What it needs").click()
    expect(row).to_contain_text("Missing: reference standards. State [[standards]]")
    expect(row).not_to_contain_text("Missing: authorisation")  # which the certification supplies
    row.get_by_role("button", name="Certify").click()
    expect(page.get_by_role("dialog")).to_contain_text("No certificate can be issued afterwards.")


def test_standards_of_an_import_are_stated_in_its_files_wherever_they_are_asked_for(
    service: Service, visit: Callable[..., Page]
) -> None:
    from playwright.sync_api import expect

    page = visit(f"/units/{UNIT}")
    use = page.get_by_role("region", name="Uncertainty in use")
    expect(use).to_contain_text("State clock, fixture_angle, level as [[standards]] and latitude_deg for earth_rate in")
    expect(use).to_contain_text("recording.toml of the imported folder")
    expect(page.locator("main")).not_to_contain_text("bench file")
    answer = service.get(f"{VERSIONS}/2/uncertainty?rate_dps=50&temperature_c=43")
    assert answer["not_stated_remedy"].endswith("import it again and fit the new recording.")
    missing = service.get(f"{VERSIONS}/2/certificate/missing")
    assert not any("bench file" in each["where"] + each["remedy"] for each in missing)


def test_one_axis_is_not_offered_a_live_calibration(service: Service, visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    assert service.get(f"/api/units/{UNIT}")["axes"] == ["z"]
    page = visit(f"/units/{UNIT}")
    expect(page.get_by_role("link", name="Explore").first).to_be_visible()
    expect(page.get_by_role("link", name="Calibrate live")).to_have_count(0)


def test_what_is_new_lists_versions_and_certifications(visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    page = visit("/start")
    news = page.get_by_role("region", name="What is new")
    expect(news).to_contain_text(f"{UNIT} version 2 was certified by Ann.")
    expect(news).to_contain_text(f"{UNIT} version 2 was made: bias_scale+sine_response.")
    expect(news).to_contain_text(f"{UNIT} version 1 was made: bias_scale.")
    expect(page.get_by_role("region", name="Bench")).to_contain_text(f"{NO_BENCH.capitalize()}.")


@pytest.mark.slow
def test_the_next_experiment_is_a_recipe_where_no_bench_can_run_it(
    service: Service, visit: Callable[..., Page]
) -> None:
    from playwright.sync_api import expect

    page = visit(f"/explore?unit={UNIT}&version=1")
    settled(page)
    expect(page.get_by_role("region", name="Verdict")).to_contain_text("sine response (open-loop interferometer)")
    expect(page.locator("main")).not_to_contain_text("this bench")
    page.get_by_role("button", name="Next experiment").click()
    expect(page.get_by_text(f"This experiment is for {UNIT}. {NO_BENCH.capitalize()}.")).to_be_visible()
    expect(page.get_by_text(f"labctl campaign start {UNIT}-next.toml --bench FILE")).to_be_visible()
    with page.expect_download() as saved:
        page.get_by_role("button", name="Download the recipe").click()
    best = service.get(f"{VERSIONS}/1/criticism")["experiments"][0]
    assert saved.value.path().read_text(encoding="utf-8") == best["toml"]
    assert saved.value.suggested_filename == f"{UNIT}-next.toml"


@pytest.mark.slow
def test_maps_of_two_versions_have_one_scale_and_temperatures_one_unit(visit: Callable[..., Page]) -> None:
    ends = []
    for version in (1, 2):
        page = visit(f"/explore?unit={UNIT}&version={version}")
        settled(page)
        layout: dict[str, Any] = figure(page, "Residual over floor")["layout"]
        ends.append((layout["coloraxis"]["cmin"], layout["coloraxis"]["cmax"]))
        assert layout["yaxis"]["title"]["text"] == "temperature, °C"
        assert "deg C" not in page.locator("main").inner_text()
    assert ends == [(-5, 5)] * 2


@pytest.mark.slow
def test_the_second_tab_is_told_that_its_version_exists(
    service: Service, visit: Callable[..., Page], faults: Faults
) -> None:
    from playwright.sync_api import expect

    first, second = (visit(f"/explore?unit={UNIT}&version=1") for _ in range(2))
    for page in (first, second):
        settled(page)
        learn = page.get_by_role("region", name="Which effects are missing")
        learn.get_by_role("listitem").filter(has_text="scale factor odd").get_by_role("button", name="Add").click()
        expect(page.get_by_role("button", name="Make version 3")).to_be_visible()
    first.get_by_role("button", name="Make version 3").click()
    first.wait_for_url("**version=3**")
    first.close()
    second.get_by_role("button", name="Make version 3").click()
    told = second.get_by_role("dialog")
    expect(told).to_contain_text("exists already: bias_scale+scale_factor_odd, made from version 1 at")
    assert [row["version"] for row in service.get(VERSIONS)] == [3, 2, 1]
    faults.clear()  # the browser reports the refusal
    told.get_by_role("button", name="Make another version").click()
    second.wait_for_url("**version=4**")


def test_a_focused_field_is_never_behind_the_buttons_of_its_dialog(visit: Callable[..., Page]) -> None:
    page = visit(f"/units/{UNIT}", size=SCREEN)
    page.get_by_role("button", name="Certify: put in force").click()
    dialog = page.get_by_role("dialog")
    dialog.get_by_label("Who").wait_for()
    hidden = """field => {
      const bar = field.form.querySelector(".dialog-actions").getBoundingClientRect();
      return field.getBoundingClientRect().bottom > bar.top;
    }"""
    for field in dialog.get_by_role("textbox").all():
        field.focus()
        assert not field.evaluate(hidden), field.get_attribute("name")


@pytest.mark.slow
def test_on_a_phone_the_links_of_the_page_fit_and_tools_lie_over_no_figure(visit: Callable[..., Page]) -> None:
    page = visit(f"/explore?unit={UNIT}&version=1", size=NARROW)
    settled(page)
    assert page.locator(".page-nav").evaluate("bar => bar.scrollWidth <= bar.clientWidth")
    figure(page, "Error ladder")
    plot = page.locator('.plot[aria-label^="Error ladder"]')
    places = plot.evaluate(
        "plot => ['.modebar-container', '.main-svg'].map(name => plot.querySelector(name).getBoundingClientRect())"
    )
    tools_end = plot.locator(".modebar").evaluate("bar => bar.getBoundingClientRect().bottom")
    assert tools_end <= places[1]["top"] + 1
    for bar in page.locator(".toolbar").all():
        assert bar.evaluate("bar => bar.scrollWidth <= bar.clientWidth"), bar.inner_text()

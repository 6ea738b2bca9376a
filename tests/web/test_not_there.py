"""Pages of what does not exist, or does not yet, lead on."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest

from tests.helpers.browser import Faults, Service

if TYPE_CHECKING:
    from playwright.sync_api import Page


@pytest.mark.slow
def test_a_unit_on_the_bench_that_was_not_measured_has_a_page(
    service: Service, visit: Callable[..., Page], faults: Faults
) -> None:
    from playwright.sync_api import expect

    (bench,) = service.get("/api/benches")
    serial = bench["units"][0]["serial"]
    page = visit("/bench")
    page.get_by_role("main").get_by_role("link", name=serial).first.click()
    expect(page.get_by_role("heading", level=1)).to_have_text(serial)
    expect(page.get_by_role("main")).to_contain_text(f"On bench {bench['name']}; not measured yet.")
    expect(page.get_by_role("link", name="Plan a campaign")).to_have_attribute("href", "/campaigns/new")
    assert len(faults) == 1  # the browser reports the 404 of the unit alone
    faults.clear()


@pytest.mark.slow
def test_what_does_not_exist_offers_what_does(service: Service, visit: Callable[..., Page], faults: Faults) -> None:
    from playwright.sync_api import expect

    made = service.post("/api/recordings/example", {"name": "osu-fog"})
    service.post("/api/units/OSU-FOG-2024/calibrations", {"recording": made["recording"], "model": "bias_scale"})
    page = visit("/explore?unit=OSU-FOG-2024&version=9")
    expect(page.get_by_role("main")).to_contain_text("9")
    expect(page.get_by_role("button", name="Try again")).to_have_count(0)
    page.get_by_role("link", name="Versions of OSU-FOG-2024").click()
    expect(page.get_by_role("heading", level=1)).to_have_text("OSU-FOG-2024")
    expect(page.get_by_role("button", name="Diagnose")).to_have_count(0)
    expect(page.get_by_text("carries FOG-0001, and not OSU-FOG-2024")).to_be_visible()
    faults.clear()

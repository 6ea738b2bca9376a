"""The whole story as a person lives it: run a campaign with a hidden effect, fit, see, learn, add, watch, certify."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest

from tests.helpers.browser import Service

if TYPE_CHECKING:
    from playwright.sync_api import Page


@pytest.mark.slow
def test_from_a_simulated_campaign_to_a_certified_file(service: Service, visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    service.post("/api/campaigns", {"recipe": "ojeda2000-121", "hide": ["scale_factor_asymmetry=0.0002"]})
    page = visit("/bench")
    expect(page.locator("main")).to_contain_text("ojeda2000-121")
    service.until("/api/campaigns/1", lambda answer: answer["state"] == "done")

    page.goto(f"{service.url}/explore")
    page.get_by_label("Model", exact=True).select_option("ojeda2000")
    page.get_by_role("button", name="Fit").click()
    verdict = page.get_by_role("region", name="Verdict")
    expect(verdict).to_contain_text("Missing: scale factor asymmetry.")

    learn = page.get_by_role("region", name="Which effects are missing")
    learn.get_by_role("button", name="Draw").first.click()
    expect(learn).to_contain_text("the part of the residual that scale factor asymmetry would explain")
    learn.get_by_role("button", name="Add", exact=True).first.click()
    adding = page.get_by_role("region", name="Add it")
    expect(adding).to_contain_text("RMS residual")
    adding.get_by_role("button", name="Make version 2").click()
    page.wait_for_url("**version=2**")
    expect(page.get_by_role("region", name="Verdict")).to_contain_text("Adequate: nothing is missing")
    expect(page.get_by_role("region", name="Error of the versions")).to_contain_text("Version 1: residual before")

    ladder = service.get("/api/units/FOG-0001/ladder")["steps"]
    assert ladder[1]["heldout_rms_dps"] < 0.75 * ladder[0]["heldout_rms_dps"]

    page.goto(f"{service.url}/units/FOG-0001")
    expect(page.get_by_role("region", name="In force")).to_contain_text("No calibration is in force")
    page.get_by_role("button", name="Certify").first.click()
    asked = page.get_by_role("dialog")
    asked.get_by_label("Who").fill("A. Person")
    asked.get_by_label("Why").fill("the error fell to the floor")
    asked.get_by_role("button", name="Certify").click()
    expect(page.get_by_role("region", name="In force")).to_contain_text("version 2")
    with page.expect_download() as download:
        page.get_by_role("button", name="Download JSON").click()
    assert download.value.suggested_filename == "FOG-0001.json"
    files = page.get_by_role("region", name="In force")
    files.get_by_label("File format").select_option("table-csv")
    files.get_by_label("temperatures").fill("3")
    with page.expect_download() as table:
        files.get_by_role("button", name="Download Table (CSV)").click()
    assert b"axis,by_axis,output_dps,temperature_c,error_dps" in table.value.path().read_bytes()
    files.get_by_label("File format").select_option("c")
    expect(files.get_by_role("button", name="Download C header")).to_be_visible()
    file = json.loads(download.value.path().read_bytes())
    assert file["serial"] == "FOG-0001"
    assert "scale_factor_asymmetry" in [term["effect"] for term in file["model"]["terms"]]

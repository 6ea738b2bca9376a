"""The pages of a service that only reads: they show what the others show, and nothing that changes something."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest

from tests.helpers.browser import Faults, Service

if TYPE_CHECKING:
    from playwright.sync_api import Page

LAB = "http://lab.example:8420"
#: What no visible button of a page says.
ACTS = re.compile(
    "^(Set batch|Certify|Revoke|Issue certificate|Diagnose|Choose files|Open the real gyro|Simulate the recording)$"
)


@pytest.mark.slow
def test_pages_say_that_the_service_only_reads_and_show_no_act(
    service: Service, visit: Callable[..., Page], faults: Faults
) -> None:
    from playwright.sync_api import expect

    serial = service.post("/api/recordings/simulated", {"recipe": "ojeda2000-121", "hide": [], "seed": 1})["serial"]
    service.post(f"/api/units/{serial}/calibrations", {"model": "ojeda2000"})
    page = visit(f"/units/{serial}")
    expect(page.get_by_role("button", name=ACTS).first).to_be_visible()
    assert page.locator("[data-read-only-words]").inner_text() == ""
    service.stop()
    service.acts_at = LAB
    service.start()
    for path in (f"/units/{serial}", "/recordings", "/start", "/campaigns/new"):
        page = visit(path)
        words = page.locator("[data-read-only-words]")
        expect(words).to_have_text(f"This service only reads. To change something: {LAB}.")
        expect(words.get_by_role("link")).to_have_attribute("href", LAB)
        acts = page.locator(".act")
        acts.first.wait_for(state="attached")
        assert not [act for act in acts.all() if act.is_visible()], path
        expect(page.get_by_role("button").filter(has_text=ACTS.split("|", maxsplit=1)[0])).to_have_count(0)
    for path, said in (
        ("/live", "A live calibration is not begun here"),
        ("/campaigns/new", "A campaign is planned here and begun elsewhere"),
        ("/recordings", "Nothing is imported here"),
        ("/bench", "No bench is driven from here"),
    ):
        page = visit(path)
        expect(page.locator(".read-only-note")).to_contain_text(f"{said}: this service only reads.")
        expect(page.get_by_label("Target U", exact=True)).to_be_hidden()
        expect(page.get_by_text("labctl serve --simulate")).to_be_hidden()
        expect(page.get_by_role("link", name="Calibrate live")).to_have_count(0)
        expect(page.get_by_role("banner")).not_to_contain_text("bench")  # there is none that could answer
    answer = page.evaluate("""async () => {
      const { post } = await import("/static/js/core/http/api.js");
      return post("/api/batches", { body: { batch: "B", serials: ["G"] } }).catch((error) => error.message);
    }""")
    assert answer.endswith(f"nothing was changed and nothing was stopped; send the request to {LAB}")
    faults.clear()  # the browser reports the refusal

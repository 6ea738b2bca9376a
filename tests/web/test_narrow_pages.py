"""Pages on a phone: a serial number of 64 characters, two versions side by side, cards without empty lines."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from labctl.recording import Recording
from tests.helpers.browser import NARROW, Service, figure, settled
from tests.helpers.simulated_recordings import single_axis

if TYPE_CHECKING:
    from playwright.sync_api import Page

LONG = ("GYRO-" + "X" * 20 + "-" + "0123456789" * 4)[:64]
PAGES = ("/", "/units", f"/units/{LONG}", "/recordings", "/recordings/1", "/fleet", f"/explore?unit={LONG}&version=2")


@pytest.fixture(scope="module")
def template(furnish: Callable[..., Path]) -> Path:
    """A unit with a long serial number and two versions that were criticised."""

    def fitted(service: Service) -> None:
        made = single_axis(3)
        info = made.info.model_copy(update={"serial": LONG})
        service.lab_service.store.recordings.add_import(
            Recording(info, made.columns, made.environment), info.started_at
        )
        path = f"/api/units/{LONG}/calibrations"
        for effects in (["bias"], ["bias", "scale_factor"]):
            service.post(path, {"effects": effects})
        service.get(f"{path}/2/criticism")

    return furnish(fitted)


@pytest.mark.slow
def test_no_page_is_wider_than_a_phone_with_a_long_serial_number(service: Service, visit: Callable[..., Page]) -> None:
    assert len(LONG) == 64
    for path in PAGES:
        page = visit(path, size=NARROW)
        settled(page)
        assert LONG in page.locator("main").inner_text() or path == "/fleet", path
        assert page.evaluate("document.documentElement.scrollWidth") <= NARROW["width"], path
        page.close()


@pytest.mark.slow
def test_two_versions_stand_below_each_other_with_one_scale_and_a_card_has_no_empty_line(
    service: Service, visit: Callable[..., Page]
) -> None:
    page = visit(f"/explore?unit={LONG}&version=2&view=surface&beside=1", size=NARROW)
    drawn = figure(page, "Residual surfaces")["layout"]
    upper, lower = (drawn[scene] for scene in ("scene", "scene2"))
    assert upper["domain"]["y"][0] >= lower["domain"]["y"][1]
    assert upper["zaxis"]["range"] == lower["zaxis"]["range"]
    assert page.evaluate("document.documentElement.scrollWidth") <= NARROW["width"]

    caption = (
        page.locator("figure").filter(has=page.locator('.plot[aria-label^="Residual surfaces"]')).locator("figcaption")
    )
    assert "what version 2 (above) and version 1 (below) leave" in caption.inner_text()

    page.goto(f"{service.url}/units")
    row = page.get_by_role("row").filter(has_text=LONG)
    row.wait_for()
    unit = service.get(f"/api/units/{LONG}")
    assert (unit["batch"], unit["due"]) == ("", None)
    shown = [cell.get_attribute("data-title") for cell in row.locator("td").all() if cell.is_visible()]
    assert "Versions" in shown
    assert not {"Batch", "Verdict when certified", "Due"} & set(shown)

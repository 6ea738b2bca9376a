"""Explore: what is picked in one picture shows in all, and every state has a link of its own."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest

from tests.helpers.browser import Service

if TYPE_CHECKING:
    from playwright.sync_api import Page

pytestmark = pytest.mark.timeout(300)


@pytest.fixture
def explored(service: Service) -> str:
    made = service.post(
        "/api/recordings/simulated",
        {"recipe": "ojeda2000-121", "hide": ["scale_factor_asymmetry=0.0002"], "seed": 1},
    )
    serial = made["serial"]
    service.post(f"/api/units/{serial}/calibrations", {"model": "ojeda2000"})
    return f"/explore?unit={serial}"


def test_a_pick_shows_everywhere_and_in_the_address(visit: Callable[..., Page], explored: str) -> None:
    from playwright.sync_api import expect

    page = visit(explored)
    fails = page.get_by_role("region", name="Where the model fails")
    fails.scroll_into_view_if_needed()
    picture = fails.locator(".plot").first
    expect(picture.locator(".heatmaplayer image").first).to_be_attached()
    box = picture.bounding_box()
    assert box is not None
    page.mouse.click(box["x"] + 0.45 * box["width"], box["y"] + 0.4 * box["height"])
    expect(fails).to_contain_text("1 data sets picked")
    assert "pick=" in page.url
    page.reload()
    expect(page.get_by_role("region", name="Where the model fails")).to_contain_text("1 data sets picked")
    fails.get_by_role("button", name="Clear selection").click()
    expect(fails).to_contain_text("Nothing is picked")
    assert "pick=" not in page.url


@pytest.mark.parametrize("view", ["Error over rate", "Error over temperature", "Surface", "At rest", "Per full turn"])
def test_measured_and_modelled_are_compared_in_every_view(visit: Callable[..., Page], explored: str, view: str) -> None:
    from playwright.sync_api import expect

    page = visit(explored)
    compare = page.get_by_role("region", name="Compare")
    compare.get_by_role("button", name=view, exact=True).click()
    expect(compare.locator(".plot .main-svg").first).to_be_attached()
    assert compare.locator(".notice.bad").count() == 0
    with page.expect_download() as download:
        compare.get_by_role("button", name="as CSV").click()
    assert len(download.value.path().read_text().splitlines()) > 10


def test_a_formula_of_ones_own_is_previewed_and_an_error_said(visit: Callable[..., Page], explored: str) -> None:
    from playwright.sync_api import expect

    page = visit(explored)
    adding = page.get_by_role("region", name="Add it")
    adding.get_by_label("A formula of your own").fill("odd: rate_dps * abs(rate_dps)")
    adding.get_by_role("button", name="Preview").click()
    expect(adding).to_contain_text("Make version 2")

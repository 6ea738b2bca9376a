"""Explore: what is picked in one picture shows in all, and every state has a link of its own."""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.helpers.browser import Service

if TYPE_CHECKING:
    from playwright.sync_api import Page


#: Keep the middle of each square that outlines a cell before Plotly has drawn it, in px of the page.
WATCH_OUTLINES = """() => {
  window.outlined = [];
  new MutationObserver((changes) => {
    for (const { addedNodes } of changes)
      for (const node of addedNodes)
        if (node.classList?.contains("point-outlines"))
          window.outlined.push([...node.children].map((square) => {
            const { x, y, width, height } = square.getBoundingClientRect();
            return [x + width / 2 + scrollX, y + height / 2 + scrollY];
          }));
  }).observe(document.querySelector("main"), { childList: true, subtree: true });
}"""
#: The middle of each square of Plotly's trace of picked cells.
PICKED = """(plot) => {
  const scatters = plot.data.filter((trace) => trace.type === "scatter").map((trace) => trace.name);
  const trace = plot.querySelectorAll(".scatterlayer .trace")[scatters.indexOf("picked")];
  return [...trace.querySelectorAll("path.point")].map((point) => {
    const { x, y, width, height } = point.getBoundingClientRect();
    return [x + width / 2 + scrollX, y + height / 2 + scrollY];
  });
}"""


@pytest.fixture(scope="module")
def template(furnish: Callable[..., Path]) -> Path:
    def fitted(service: Service) -> None:
        hidden = {"recipe": "ojeda2000-121", "hide": ["scale_factor_asymmetry=0.0002"], "seed": 1}
        serial = service.post("/api/recordings/simulated", hidden)["serial"]
        service.post(f"/api/units/{serial}/calibrations", {"model": "ojeda2000"})

    return furnish(fitted)


@pytest.fixture
def explored(service: Service) -> str:
    return f"/explore?unit={service.get('/api/recordings/1')['serial']}"


@pytest.mark.slow
def test_a_picked_cell_is_outlined_at_once_where_it_is_drawn_then(visit: Callable[..., Page], explored: str) -> None:
    from playwright.sync_api import expect

    page = visit(explored)
    fails = page.get_by_role("region", name="Where the model fails")
    fails.scroll_into_view_if_needed()
    picture = fails.locator(".plot").first
    expect(picture.locator(".heatmaplayer image").first).to_be_attached()
    page.evaluate(WATCH_OUTLINES)
    for across in (0.45, 0.25):
        picture.scroll_into_view_if_needed()
        box = picture.bounding_box()
        assert box is not None
        page.mouse.click(box["x"] + across * box["width"], box["y"] + 0.4 * box["height"])
        expect(fails).to_contain_text("1 data set selected")
        expect(fails.locator(".point-outlines")).to_have_count(0)
        ((x, y),) = picture.evaluate(PICKED)
        ((outlined_x, outlined_y),) = page.evaluate("() => window.outlined.at(-1)")
        assert (outlined_x, outlined_y) == (pytest.approx(x, abs=1.0), pytest.approx(y, abs=1.0))
        assert abs(x - box["x"] - across * box["width"]) < 0.05 * box["width"]
        fails.get_by_role("button", name="Clear selection").click()
        expect(fails).to_contain_text("No data set is selected")


@pytest.mark.slow
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
    expect(fails).to_contain_text("1 data set selected")
    assert "pick=" in page.url
    page.reload()
    expect(page.get_by_role("region", name="Where the model fails")).to_contain_text("1 data set selected")
    fails.get_by_role("button", name="Clear selection").click()
    expect(fails).to_contain_text("No data set is selected")
    assert "pick=" not in page.url


def test_the_map_is_saved_with_each_data_set_and_with_what_it_is_of(
    visit: Callable[..., Page], service: Service, explored: str
) -> None:
    serial = explored.partition("=")[2]
    page = visit(explored)
    fails = page.get_by_role("region", name="Where the model fails")
    fails.scroll_into_view_if_needed()
    fails.locator(".plot .main-svg").first.wait_for()
    fails.get_by_text("of version 1 leaves of recording 1, to which it was fitted").wait_for()
    with page.expect_download() as download:
        fails.get_by_role("button", name="as CSV").first.click()
    first, *lines = download.value.path().read_text().splitlines()
    criticism = service.get(f"/api/units/{serial}/calibrations/1/criticism")
    calibration = service.get(f"/api/units/{serial}/calibrations/1")
    assert first.startswith("# ")
    assert f"unit {serial}, version 1 ({calibration['hash'][:12]}), recording 1; saved 20" in first
    assert download.value.suggested_filename.startswith(f"unit-{serial.lower()}-version-1-recording-1-")
    rows = list(csv.DictReader(lines))
    saved = {
        (row["axis"], row["position"], int(row["data set"])): (
            float(row["table rate, deg/s"]), float(row["temperature, deg C"]),
            float(row["residual, deg/s"]), float(row["residual / noise floor"]),
        )
        for row in rows
    }  # fmt: skip
    stated = {
        (of["axis"], of["position"], number): figures
        for of in criticism["maps"]
        for number, *figures in zip(
            of["dataset"], of["table_rate_dps"], of["temperature_c"], of["residual_dps"], of["over_floor"], strict=True
        )
    }
    assert len(rows) == len(saved) == len(stated) == 121
    assert saved == {key: tuple(figures) for key, figures in stated.items()}


@pytest.mark.parametrize("kind", ["PNG", "SVG"])
def test_a_saved_picture_says_what_it_is_of(visit: Callable[..., Page], explored: str, kind: str) -> None:
    serial = explored.partition("=")[2]
    page = visit(explored)
    fails = page.get_by_role("region", name="Where the model fails")
    fails.scroll_into_view_if_needed()
    fails.locator(".plot .main-svg").first.wait_for()
    with page.expect_download() as download:
        fails.get_by_role("button", name=f"as {kind}").first.click()
    content = download.value.path().read_bytes()
    if kind == "PNG":
        assert content.startswith(b"\x89PNG")
        assert len(content) > 10_000
    else:
        assert f"unit {serial}, version 1 (" in content.decode()
    assert page.get_by_text(f"unit {serial}, version 1 (").count() == 0, "the figure of the page stays as it was"


@pytest.mark.slow
@pytest.mark.parametrize(
    "view", ["Error over rate", "Error over temperature", "Surface", "At rest", "Error of a full turn"]
)
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


@pytest.mark.slow
def test_a_formula_of_ones_own_is_previewed_and_an_error_said(visit: Callable[..., Page], explored: str) -> None:
    from playwright.sync_api import expect

    page = visit(explored)
    adding = page.get_by_role("region", name="Add it")
    adding.get_by_label("A formula of your own").fill("odd: rate_dps * abs(rate_dps)")
    adding.get_by_role("button", name="Preview").click()
    expect(adding).to_contain_text("Make version 2")

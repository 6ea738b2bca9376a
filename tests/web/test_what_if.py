"""The size of a suspect as a slider: what it would leave is what the service computes for that size."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import parse_qs

import numpy as np
import pytest

from labctl.services.planning.plan_answer import describe_plan
from tests.helpers.browser import Service, figure, number_of, settled

if TYPE_CHECKING:
    from playwright.sync_api import Locator, Page

RMS = re.compile(r"([0-9.]+) deg/s RMS left on axis z, over 695 data sets")


@pytest.fixture
def opened(service: Service, visit: Callable[..., Page]) -> tuple[Page, Locator]:
    made = service.post("/api/recordings/example", {"name": "osu-fog"})
    fit = {"recording": made["recording"], "model": "bias_scale"}
    service.post(f"/api/units/{made['serial']}/calibrations", fit)
    page = visit(f"/explore?unit={made['serial']}")
    settled(page)
    learn = page.get_by_role("region", name="Which effects are missing")
    learn.get_by_role("listitem").filter(has_text="sine response").get_by_role("button", name="What if").click()
    panel = page.get_by_role("region", name="What if: sine response")
    panel.wait_for()
    return page, panel


def rms_shown(panel: Locator) -> float:
    found = RMS.search(panel.locator("output").first.inner_text())
    assert found
    return float(found.group(1))


@pytest.mark.slow
def test_the_slider_moves_between_the_fits_without_and_with_the_effect(
    opened: tuple[Page, Locator], service: Service
) -> None:
    from playwright.sync_api import expect

    page, panel = opened
    unit = "/api/units/OSU-FOG-2024/calibrations/1"
    before = service.get(f"{unit}/criticism")
    after = service.post(f"{unit}/preview", {"add": ["sine_response"]})
    assert rms_shown(panel) == float(f"{after['error']['rms_dps']:.3g}")
    slider = panel.get_by_role("slider", name="Size of")
    slider.fill("0")
    expect(panel.locator("output").first).to_contain_text("0 % of the fitted size")
    assert rms_shown(panel) == float(f"{before['error']['rms_dps']:.3g}")
    slider.fill("0.5")
    expect(panel.locator("output").first).to_contain_text("50 % of the fitted size")
    drawn = np.array(figure(page, "What would be left.")["data"][0]["y"])
    middle = (np.array(before["views"]["sets"]["residual_dps"]["z"]) + np.array(after["residuals"]["residual_dps"])) / 2
    assert np.abs(drawn - middle).max() < 1e-5
    assert rms_shown(panel) == float(f"{np.sqrt(np.mean(middle**2)):.3g}")


@pytest.mark.slow
def test_a_second_effect_lies_over_it_and_their_parting_rates_become_a_plan(
    opened: tuple[Page, Locator], tmp_path: Path
) -> None:
    from playwright.sync_api import expect

    page, panel = opened
    panel.get_by_label("Lay another effect over it").select_option("saturation")
    note = panel.locator(".notice")
    expect(note).to_contain_text("sine response and saturation part at table rate, deg/s")
    names = [trace.get("name") for trace in figure(page, "What the effect would explain")["data"]]
    assert "saturation" in names
    address = note.get_by_role("link", name="Plan these rates").get_attribute("href") or ""
    path, _, query = address.partition("?")
    recipe = tmp_path / "parting.toml"
    recipe.write_text(parse_qs(query)["toml"][0], encoding="utf-8")
    plan = describe_plan(str(recipe), "triaxial-sim", clip=False)
    marked = [shape["x0"] for shape in figure(page, "What the effect would explain")["layout"]["shapes"]]
    rates = tomllib.loads(recipe.read_text(encoding="utf-8"))["rates_dps"]
    assert path == "/campaigns/new"
    assert plan.datasets == 3 * len(rates)
    assert [min(rates), max(rates)] == pytest.approx([min(marked), max(marked)], rel=1e-3)


@pytest.mark.slow
def test_another_shape_is_fitted_again_by_the_service_and_the_fitted_one_comes_back(
    opened: tuple[Page, Locator], service: Service
) -> None:
    from playwright.sync_api import expect

    page, panel = opened
    expect(panel.get_by_role("slider")).to_have_count(1)  # K of the sine is found by the fit, whatever is stated
    learn = page.get_by_role("region", name="Which effects are missing")
    learn.get_by_role("listitem").filter(has_text="saturation").get_by_role("button", name="What if").click()
    panel = page.get_by_role("region", name="What if: saturation")
    best = rms_shown(panel)
    knee = panel.get_by_role("slider", name="rate above which")
    knee.fill("36.4")
    knee.dispatch_event("change")
    expect(panel).to_contain_text("Fitted again with this shape.")
    stated = number_of(panel.locator("label", has_text="Shape:").locator("span.muted").inner_text().split()[0])
    assert 60 < stated < 80
    expected = service.post(
        "/api/units/OSU-FOG-2024/calibrations/1/preview", {"add": [f"saturation@knee_dps={stated}"]}
    )
    assert rms_shown(panel) == pytest.approx(expected["error"]["rms_dps"], rel=0.01) != best
    drawn = np.array(figure(page, "What would be left.")["data"][0]["y"])
    assert np.abs(drawn - np.array(expected["residuals"]["residual_dps"])).max() < 0.01
    panel.get_by_role("button", name="Fitted shape").click()
    expect(panel.locator("output").first).to_contain_text(f"{best} deg/s RMS left")


#: What of the titles of a figure lies under its tool bar or under another title.
UNDER = """plot => {
  const box = each => each.getBoundingClientRect();
  const titles = [...plot.querySelectorAll(".annotation-text")].map(box);
  const bar = box(plot.querySelector(".modebar"));
  const meet = (a, b) => a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
  const pairs = titles.flatMap((one, k) => [bar, ...titles.slice(k + 1)].filter((other) => meet(one, other)));
  return { titles: titles.length, bar: bar.height, under: pairs.length };
}"""


@pytest.mark.slow
@pytest.mark.parametrize("width", [390, 1000, 1280])
def test_the_title_of_the_map_is_not_under_the_tool_bar(opened: tuple[Page, Locator], width: int) -> None:
    page, panel = opened
    page.set_viewport_size({"width": width, "height": 900})
    drawn = panel.get_by_role("group", name="What would be left over floor")
    drawn.scroll_into_view_if_needed()
    drawn.locator(".annotation-text").first.wait_for()
    panel.get_by_role("slider", name="Size of").fill("0.5")  # drawn again, at this width
    page.wait_for_function(
        "plot => plot.querySelector('.main-svg').clientWidth === plot.clientWidth", arg=drawn.element_handle()
    )
    drawn.hover()
    found = drawn.evaluate(UNDER)
    assert found["titles"] == 1
    assert found["bar"] > 10
    assert found["under"] == 0, found

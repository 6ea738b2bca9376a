"""Points of a recipe that are dragged, or moved by keys: hours, U and what can be seen are the service's, at once."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

import pytest

from tests.helpers.browser import MINUS, Service, number_of

if TYPE_CHECKING:
    from playwright.sync_api import Locator, Page, Request

PATH = "/api/designs/evaluation"
RECIPE = """format = "labctl-recipe/1"
name = "few"
temperatures_c = [25, 35, 45]
rates_dps = [-80, -40, 0, 40, 80]
positions = ["z"]
"""


def numbers(card: Locator) -> dict[str, str]:
    rows = (row.split("\n") for row in card.locator(".fact").all_inner_texts())
    return {name: value for name, value, *_ in rows}


def levels(text: str) -> list[float]:
    return [
        number_of(value) for value in re.findall(r"\u2212?\d+(?:\.\d+)?", text.replace("deg/s", "").replace("°C", ""))
    ]


def check(service: Service, card: Locator, **points: list[float]) -> dict[str, Any]:
    """Compare what the card states with the service's answer for these points."""
    answer: dict[str, Any] = service.post(PATH, {"recipe": RECIPE, **points})
    evaluated, shown = answer["evaluated"], numbers(card)
    assert levels(shown["Rates"]) == answer["rates_dps"]
    assert levels(shown["Temperatures"]) == answer["temperatures_c"]
    assert float(shown["Bench hours"].split(maxsplit=1)[0]) == pytest.approx(evaluated["hours"], rel=1e-3)
    assert float(shown["Largest U, k = 2"].split(maxsplit=1)[0]) == pytest.approx(evaluated["u_worst_dps"], rel=5e-3)
    visible = service.post("/api/plans", {"recipe": answer["recipe_toml"], "visibility": True})["visibility"]
    able = [each for each in visible if each["visible"]]
    card.get_by_text(f"This plan can detect {len(able)} of {len(visible)} effects").wait_for()
    return evaluated


@pytest.mark.slow
def test_points_are_moved_by_mouse_and_keys_and_the_last_request_wins(
    service: Service, visit: Callable[..., Page]
) -> None:
    from playwright.sync_api import expect

    page = visit(f"/campaigns/new?toml={quote(RECIPE)}")
    page.get_by_text("Design a campaign for an uncertainty").click()
    page.get_by_role("button", name="Move the points").click()
    card = page.get_by_role("region", name="Points of the recipe")
    card.get_by_text("This plan can detect").wait_for()
    before = check(service, card)

    asked: list[dict[str, Any]] = []

    def note(request: Request) -> None:
        if request.url.endswith(PATH):
            asked.append(json.loads(request.post_data or "{}"))

    page.on("request", note)
    point = card.locator('.point[data-point="80,45"]')
    point.scroll_into_view_if_needed()
    box, step = point.bounding_box(), card.locator('.point[data-point="40,35"]').bounding_box()
    assert box is not None
    assert step is not None
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.down()
    for share in (0.2, 0.4, 0.6, 0.75):  # towards the point of 40 deg/s and 35 °C
        page.mouse.move(
            box["x"] + box["width"] / 2 + share * (step["x"] - box["x"]),
            box["y"] + box["height"] / 2 + share * (step["y"] - box["y"]),
        )
    page.mouse.up()
    expect(card).not_to_have_attribute("aria-busy", "true")
    moved = numbers(card)
    rates, temperatures = levels(moved["Rates"]), levels(moved["Temperatures"])
    assert rates[:4] == [-80, -40, 0, 40]
    assert rates[4] == pytest.approx(50, abs=2)
    assert temperatures[2] == pytest.approx(37.5, abs=1)
    after = check(service, card, rates_dps=rates, temperatures_c=temperatures)
    assert after["u_worst_dps"] > 1.2 * before["u_worst_dps"]  # of the range as it was
    assert asked[-1]["rates_dps"] == rates
    assert len(asked) <= 3  # four movements are asked for together

    slider = card.get_by_role("slider", name="Rate 1 of 5")
    slider.focus()
    for key in ("ArrowRight", "ArrowRight", "Shift+ArrowRight", "ArrowLeft"):
        page.keyboard.press(key)
    expect(slider).to_have_attribute("aria-valuenow", "-69")
    expect(card.locator(".facts")).to_contain_text("-69, -40, 0, 40".replace("-", MINUS))
    expect(card).not_to_have_attribute("aria-busy", "true")
    check(service, card, rates_dps=[-69.0, *rates[1:]], temperatures_c=temperatures)
    card.get_by_role("button", name="Take these points").click()
    expect(page.get_by_label("Recipe as TOML")).to_have_value(re.compile(r"rates_dps = \[\s*-69\.0"))


@pytest.mark.slow
def test_an_answer_that_comes_late_is_not_shown(service: Service, visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    page = visit("/campaigns/new?recipe=ojeda2000-121")
    page.get_by_text("Design a campaign for an uncertainty").click()
    page.get_by_role("button", name="Move the points").click()
    card = page.get_by_role("region", name="Points of the recipe")
    card.get_by_text("This plan can detect").wait_for()
    held: list[Any] = []
    page.route(f"**{PATH}", lambda route: held.append(route) if not held else route.continue_())
    slider = card.get_by_role("slider", name="Temperature 1 of 11")
    slider.focus()
    page.keyboard.press("ArrowUp")
    page.wait_for_function("() => document.querySelector('.moved-points').ariaBusy === 'true'")
    page.wait_for_timeout(600)  # the first request is on its way, and stays there
    assert len(held) == 1
    page.keyboard.press("ArrowUp")
    expect(card).not_to_have_attribute("aria-busy", "true")
    now = float(slider.get_attribute("aria-valuenow") or "nan")
    assert levels(numbers(card)["Temperatures"])[0] == now

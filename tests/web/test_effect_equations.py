"""Equations of the effects in a browser: drawn as the catalogue states them, where an effect is named."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import pytest

from tests.helpers.browser import NARROW, Service, on_page, settled

if TYPE_CHECKING:
    from playwright.sync_api import Locator, Page

#: The element as the browser has it, and how large it is drawn.
READ = """math => ({
  xml: new XMLSerializer().serializeToString(math),
  namespace: math.namespaceURI,
  height: math.getBoundingClientRect().height,
  width: math.getBoundingClientRect().width,
})"""

#: Of each symbol with an index: where the symbol ends, and where its index ends, px.
SCRIPTS = "all => all.map(each => [...each.children].map(child => child.getBoundingClientRect().bottom))"


def same(drawn: str, mathml: str) -> bool:
    """Return whether two documents are the same, however their characters are written."""
    from xml.etree import ElementTree

    return ElementTree.canonicalize(drawn) == ElementTree.canonicalize(mathml)


def of_catalogue(service: Service, effect_id: str) -> dict[str, Any]:
    return next(each for each in service.get("/api/effects")["effects"] if each["id"] == effect_id)


def findings(page: Page) -> list[str]:
    from axe_playwright_python.sync_playwright import Axe

    return [
        each["id"] + str([node["html"] for node in each["nodes"]]) for each in Axe().run(page).response["violations"]
    ]


def check_equation(place: Locator, effect: dict[str, Any]) -> None:
    found = place.locator(".equation math").evaluate(READ)
    assert found["namespace"] == "http://www.w3.org/1998/Math/MathML"
    assert same(found["xml"], effect["equation"]["mathml"])
    assert found["height"] > 15
    assert found["width"] > 40
    rows = place.get_by_role("group", name=f"Symbols of {effect['id']}").get_by_role("row")
    assert rows.count() == 1 + len(effect["equation"]["symbols"])
    for base, index in place.locator(".equation msub").evaluate_all(SCRIPTS):
        assert index > base + 2, "a subscript stands on the line, as a factor would"
    for k, symbol in enumerate(effect["equation"]["symbols"], 1):
        assert on_page(symbol["meaning"]) in rows.nth(k).inner_text()
    for source in effect["sources"]:
        assert f"{source['work']}: {source['place']}" in place.inner_text()


@pytest.mark.slow
@pytest.mark.parametrize("effect_id", ["sine_response", "thermal_hysteresis"])
def test_the_page_of_an_effect_has_its_equation_and_the_meaning_of_its_shape(
    service: Service, visit: Callable[..., Page], effect_id: str
) -> None:
    effect = of_catalogue(service, effect_id)
    page = visit(f"/effects/{effect_id}", size=NARROW)
    settled(page)
    check_equation(page.get_by_role("region", name="Equation"), effect)
    shape = page.get_by_role("group", name="Parameters").get_by_role("row")
    assert shape.count() == 1 + len(effect["parameters"])
    for k, parameter in enumerate(effect["parameters"], 1):
        assert parameter["meaning"] in shape.nth(k).inner_text()
    assert page.evaluate("document.documentElement.scrollWidth") <= NARROW["width"]
    assert not findings(page)


@pytest.mark.slow
def test_a_suspect_and_an_effect_of_the_model_open_their_equation(service: Service, visit: Callable[..., Page]) -> None:
    made = service.post("/api/recordings/example", {"name": "osu-fog"})
    fit = {"recording": made["recording"], "model": "bias_scale"}
    service.post(f"/api/units/{made['serial']}/calibrations", fit)
    page = visit(f"/explore?unit={made['serial']}")
    settled(page)
    learn = page.get_by_role("region", name="Which effects are missing")
    suspect = learn.get_by_role("listitem").filter(has_text="sine response")
    suspect.get_by_text("Equation and source").click()
    check_equation(suspect, of_catalogue(service, "sine_response"))
    model = page.get_by_role("group", name="Effects of version 1")
    model.get_by_text("scale factor", exact=True).click()
    check_equation(model.locator("details[open]"), of_catalogue(service, "scale_factor"))
    assert not findings(page)

"""The register of reference standards on its page: what is shown is what the register answers."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest

from tests.helpers.browser import NARROW, Service, figure, on_page, settled

if TYPE_CHECKING:
    from playwright.sync_api import Page

STANDARD = {"label": "Pt100-7", "quantity": "thermometer", "serial": "SN-0815", "by": "M. Meter"}
POINTS = [{"nominal": -20.0, "value": 0.012, "expanded": 0.04}, {"nominal": 50.0, "value": -0.02, "expanded": 0.05}]
CERTIFICATE = {"number": "T-1", "laboratory": "DKD 17", "calibrated": "2024-01-10", "points": POINTS, "by": "M. Meter"}


@pytest.fixture
def register(service: Service) -> Service:
    service.post("/api/standards", STANDARD)
    service.post("/api/standards/Pt100-7/certificates", CERTIFICATE)
    for value in (0.011, 0.013, 0.012, 0.0125, 0.0118, 0.0122, 0.0131, 0.0124, 0.0119, 0.9):
        check = {"value": value, "u": 0.01, "nominal": -20.0, "by": "T. Tester", "note": f"ice, {value}"}
        service.post("/api/standards/Pt100-7/checks", check)
    service.post("/api/standards", {**STANDARD, "label": "clock-1", "quantity": "clock", "serial": ""})
    return service


@pytest.mark.slow
def test_each_standard_has_its_state_and_what_it_rests_on(register: Service, visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    known, without = register.get("/api/standards")
    assert (known["state"], without["state"]) == ("check it", "no certificate")
    page = visit("/bench")
    page.get_by_role("link", name="Reference standards").click()
    rows = page.get_by_role("group", name="All standards").get_by_role("row")
    expect(rows).to_have_count(3)
    expect(rows.nth(1)).to_contain_text("Pt100-7")
    expect(rows.nth(1)).to_contain_text("check it")
    expect(rows.nth(2)).to_contain_text("no certificate")
    card = page.get_by_role("region", name="Pt100-7")
    for line in known["text"]:
        expect(card).to_contain_text(on_page(line.replace("`", "")))
    (certificate,) = known["certificates"]
    shown = card.get_by_role("group", name="Certificates of Pt100-7")
    for point in certificate["points"]:
        assert point["k"] * point["u"] == pytest.approx(0.04 if point["nominal"] < 0 else 0.05)
    expect(shown).to_contain_text(on_page("-20.0 °C: 0.0120 °C, U = 0.0400 °C (k = 2)"))
    expect(shown).to_contain_text(on_page("50.0 °C: -0.0200 °C, U = 0.0500 °C (k = 2)"))
    drawn = {trace["name"]: trace for trace in figure(page, "Control chart of Pt100-7")["data"]}
    assert drawn["check"]["y"] == [each["value"] for each in known["checks"]]
    assert drawn["check"]["error_y"]["array"] == [each["u"] for each in known["checks"]]
    assert [each == "x" for each in drawn["check"]["marker"]["symbol"]] == [
        each["state"] == "out" for each in known["checks"]
    ]
    for basis in ("history", "stated u"):
        limits = [next((one for one in each["limits"] if one["basis"] == basis), None) for each in known["checks"]]
        for name in ("low", "high"):
            expected = [None if one is None else one[name] for one in limits]
            assert any(expected)
            assert drawn[f"{name} by {basis}"]["y"] == expected


@pytest.mark.slow
def test_a_narrow_page_does_not_scroll_sideways_and_an_empty_register_says_what_to_do(
    service: Service, visit: Callable[..., Page]
) -> None:
    page = visit("/standards", size=NARROW)
    settled(page)
    assert "labctl standards add" in page.locator("main").inner_text()
    service.post("/api/standards", {**STANDARD, "label": "P" * 60})
    page.reload()
    settled(page)
    assert page.evaluate("document.documentElement.scrollWidth") <= NARROW["width"]

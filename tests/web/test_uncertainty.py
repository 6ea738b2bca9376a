"""Uncertainty in use on the page of a unit: its figures are those of the service, and what is unknown is said so."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import pytest

from tests.helpers.browser import NARROW, Faults, Service, number_of
from tests.helpers.simulated_recordings import single_axis

if TYPE_CHECKING:
    from playwright.sync_api import Locator, Page

FOG, PUBLISHED = "FOG-0001", "WEISS-ENV05S"
CARD = "Uncertainty in use (k = 2)"


@pytest.fixture
def fog(service: Service) -> str:
    """Return a unit with a calibration of 121 data sets and a data sheet."""
    recording = single_axis(1)
    service.lab_service.store.recordings.add_import(recording, recording.info.started_at)
    service.post(f"/api/units/{FOG}/calibrations", {"model": "ojeda2000"})
    return FOG


@pytest.fixture
def published(service: Service) -> str:
    """Return a unit whose calibration is a published table."""
    service.post("/api/recordings/example", {"name": "weiss-gyrostar"})
    service.post(f"/api/units/{PUBLISHED}/calibrations", {"model": "weiss1995"})
    return PUBLISHED


def two_digits(value: float) -> float:
    return float(f"{value:.1e}")


def shown_number(text: str) -> float:
    """Return a number as the page writes it, with a power of ten where it is far from 1."""
    return float(
        text.replace("\xa0", " ").replace(" × 10", "e").translate(str.maketrans("−⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "--0123456789"))
    )


def cells(region: Locator) -> list[list[str]]:
    """Return the texts of a table's body, row by row, without the headings that a narrow screen shows."""
    return [
        [cell.strip() for cell in row.locator("td > div").all_inner_texts()] for row in region.locator("tbody tr").all()
    ]


def card_of(page: Page) -> tuple[Locator, Locator, Locator]:
    """Return the card, its table over what was calibrated, and the parts at a place."""
    card = page.get_by_role("region", name=CARD, exact=True)
    parts = card.get_by_role("group", name="Parts of the uncertainty")
    parts.wait_for()
    return card, card.get_by_role("group", name="Uncertainty in use", exact=True), parts


def asked(service: Service, serial: str, rate_dps: float, temperature_c: float, version: int = 1) -> Any:
    place = f"rate_dps={rate_dps}&temperature_c={temperature_c}&grid=true"
    return service.get(f"/api/units/{serial}/calibrations/{version}/uncertainty?{place}")


@pytest.mark.slow
def test_the_figures_of_the_page_are_those_of_the_service(
    service: Service, visit: Callable[..., Page], fog: str
) -> None:
    from playwright.sync_api import expect

    page = visit(f"/units/{fog}")
    card, over, parts = card_of(page)
    here = asked(service, fog, 50, 40)
    grid = here["grid"]["axes"]["z"]
    drawn = cells(over)
    assert [number_of(row[0]) for row in drawn] == pytest.approx(here["grid"]["temperature_c"], abs=0.051)
    assert len(drawn) == 3
    for row, line in zip(drawn, grid, strict=True):
        assert [float(text) for text in row[1:]] == [two_digits(one["expanded_dps"]) for one in line]
    heads = [number_of(text.split()[0]) for text in over.locator("th").all_inner_texts()[1:]]
    assert heads == pytest.approx(here["grid"]["rate_dps"], rel=5e-3)

    card.get_by_role("spinbutton", name="Rate").fill("50")
    card.get_by_role("spinbutton", name="Temperature").fill("40")
    card.get_by_role("spinbutton", name="Temperature").press("Enter")
    page.wait_for_url("**rate=50&temperature=40")
    one = here["axes"]["z"]
    names = (
        "coefficients_dps", "model_dps", "repeatability_dps", "standards_dps", "combined_dps", "expanded_dps"
    )  # fmt: skip
    expect(parts.locator("tbody tr").last.locator("td").nth(1)).to_have_text(f"{two_digits(one['expanded_dps'])}")
    assert [float(row[1]) for row in cells(parts)] == [two_digits(one[name]) for name in names]
    assert cells(parts)[2][2] == one["repeatability_source"] == "data sheet"
    expect(parts).not_to_contain_text("nknown")
    any_axis = card.get_by_role("group", name="Uncertainty about any axis")
    assert [row[1:] for row in cells(any_axis)] == [["unknown", "unknown", "unknown"]]  # it was turned about z alone
    expect(card).to_contain_text("the unit was not turned about")
    expect(card).not_to_contain_text("outside")

    page.reload()  # the place is in the address
    card, _, parts = card_of(page)
    assert [float(row[1]) for row in cells(parts)] == [two_digits(one[name]) for name in names]
    card.get_by_role("spinbutton", name="Temperature").fill("90")
    card.get_by_role("spinbutton", name="Temperature").press("Enter")
    expect(card).to_contain_text("was not calibrated")
    expect(parts).to_contain_text("no data set was measured near there")
    kept = [cells(parts)[k][1] for k in (2, 3)]
    assert [row[1] for row in cells(parts)][1:] == ["unknown", *kept, "unknown", "unknown"]


@pytest.mark.slow
def test_the_lines_of_the_budget_and_the_pictures_are_those_of_the_service(
    service: Service, visit: Callable[..., Page], fog: str
) -> None:
    from playwright.sync_api import expect

    page = visit(f"/units/{fog}?rate=50&temperature=40")
    card, _, _ = card_of(page)
    here = asked(service, fog, 50, 40)
    card.get_by_text("Budget, line by line").click()
    lines = cells(card.get_by_role("group", name="Budget of axis z"))
    budget = here["budget"]["z"]
    assert [shown_number(row[5]) for row in lines] == [two_digits(line["contribution"]) for line in budget["lines"]]
    assert [row[1] for row in lines] == [line["type"] for line in budget["lines"]]
    figure = card.get_by_role("group", name="Contributions, axis z, over rate")
    figure.scroll_into_view_if_needed()
    expect(figure.locator(".legendtext").first).to_be_visible()
    drawn = figure.evaluate("plot => plot.data.map(({ name, x, y }) => [name, x, y])")
    over = here["grid"]["contributions"]["z"]["over_rate"]
    sums = [["combined u", over["at"], over["combined"]], ["expanded U", over["at"], over["expanded"]]]
    assert drawn[-2:] == sums
    sources = {name.replace("_", " "): values for name, values in over["contributions"].items()}
    named = {name: y for name, _, y in drawn[:-2] if not name.endswith(" others")}
    assert 0 < len(named) <= 4
    assert named == {name: sources[name] for name in named}
    (others,) = [y for name, _, y in drawn if name.endswith(" others")]
    left_out = [values for name, values in sources.items() if name not in named]
    for k, value in enumerate(others):
        assert value == pytest.approx(math.hypot(*(values[k] for values in left_out if values[k] is not None)))
    assert figure.locator(".legendtext").count() == len(drawn)
    assert figure.locator(".xtitle").text_content() == "rate, deg/s"
    assert figure.locator(".ytitle").text_content() == "standard uncertainty, deg/s"
    with page.expect_download() as download:
        card.get_by_role("button", name="Save Contributions, axis z, over rate as CSV").click()
    _, heading, *rows = download.value.path().read_text().splitlines()
    assert heading.count(", deg/s") == len(over["contributions"]) + 3  # along, and two sums
    assert len(rows) == len(over["at"])


#: The boxes of a figure's titles, of the names of its legend and of the figure itself, and of what is drawn: left,
#: right, top, bottom in CSS px.
PLACES = """plot => {
  const box = each => (({ left, right, top, bottom }) => [left, right, top, bottom])(each.getBoundingClientRect());
  const all = names => [...plot.querySelectorAll(names)].map(box);
  const [titles, names, panels] = [".xtitle, .ytitle", ".legend .traces", ".nsewdrag"].map(all);
  return { plot: box(plot), titles, names, panel: panels[0] };
}"""


@pytest.mark.slow
def test_titles_and_legend_of_contributions_are_whole_and_apart(visit: Callable[..., Page], fog: str) -> None:
    from playwright.sync_api import expect

    page = visit(f"/units/{fog}", size={"width": 1280, "height": 900})
    card, _, _ = card_of(page)
    for over in ("rate", "temperature"):
        figure = card.get_by_role("group", name=f"Contributions, axis z, over {over}")
        figure.scroll_into_view_if_needed()
        expect(figure.locator(".legendtext").first).to_be_visible()
        found = figure.evaluate(PLACES)
        left, right, top, bottom = found["plot"]
        texts = [*found["titles"], *found["names"]]
        assert len(found["titles"]) == 2
        assert len(found["names"]) >= 4
        assert min(text[0] for text in texts) >= left - 1, found
        assert max(text[1] for text in texts) <= right + 1, found
        assert min(text[2] for text in texts) >= top - 1, found
        assert max(text[3] for text in texts) <= bottom + 1, found
        assert min(name[2] for name in found["names"]) >= found["titles"][0][3] - 1, found  # below the axis
        assert found["panel"][3] - found["panel"][2] > (bottom - top) / 3, found  # the legend leaves room to the lines


@pytest.mark.slow
@pytest.mark.parametrize("size", [None, NARROW])
def test_published_coefficients_are_unknown_and_never_zero(
    visit: Callable[..., Page], published: str, size: dict[str, int] | None
) -> None:
    from playwright.sync_api import expect

    card, over, parts = card_of(visit(f"/units/{published}", **({"size": size} if size else {})))
    drawn = cells(over)
    assert {text for row in drawn for text in row[1:]} == {"unknown"}
    assert all(len(row) == 6 for row in drawn)
    assert [row[1] for row in cells(parts)] == ["unknown"] * 3 + ["not stated"] + ["unknown"] * 2
    assert cells(parts)[0][2] == "published coefficients come without uncertainties"
    expect(card).to_contain_text("Coefficients: published coefficients come without uncertainties.")


@pytest.mark.slow
def test_a_model_that_asks_for_more_is_unknown_with_its_reason(
    service: Service, visit: Callable[..., Page], faults: Faults, fog: str
) -> None:
    from playwright.sync_api import expect

    service.post(f"/api/units/{fog}/calibrations/1/improve", {"formula": ["wet: humidity_pct - 40"]})
    page = visit(f"/units/{fog}")
    card = page.get_by_role("region", name=CARD, exact=True)
    expect(card).to_contain_text("Unknown: FOG-0001 version 2: its model also needs humidity_pct")
    card.get_by_label("of").select_option("1")
    expect(card.get_by_role("group", name="Parts of the uncertainty")).to_contain_text("data sheet")
    expect(page.get_by_role("region", name="Coefficients").first.get_by_label("of")).to_have_value("1")
    faults.clear()  # the browser itself logs the refusal

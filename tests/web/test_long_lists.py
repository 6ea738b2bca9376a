"""Lists of many rows: a part at a time, a search over all of them, and an address that says what was searched."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime
from typing import TYPE_CHECKING

import pytest
import sqlalchemy as sa

from labctl.recording import RecordingInfo
from labctl.store import NewCampaign
from labctl.store.schema import tables
from tests.helpers.browser import Service
from tests.helpers.certifying import OVERRIDE

if TYPE_CHECKING:
    from playwright.sync_api import Page


AT = datetime(2026, 1, 5, 8, tzinfo=UTC)
STEP = {"kind": "acquire", "expected_s": 60.0, "rate_dps": 10.0}
ROWS = 230


def add_units(service: Service, serials: list[str]) -> None:
    """Add units with a recording each."""
    info = RecordingInfo.model_validate({"serial": "G", "axes": ["z"], "kind": "points", "started_at": AT})
    document = info.model_dump(mode="json")
    with service.lab_service.store._database.writing() as connection:
        connection.execute(
            sa.insert(tables.units),
            [{"serial": serial, "model": "VG-35", "technology": "fog", "first_seen_at": AT} for serial in serials],
        )
        connection.execute(
            sa.insert(tables.recordings),
            [
                {
                    "serial": serial,
                    "kind": "points",
                    "info": {**document, "serial": serial},
                    "channels": [],
                    "created_at": AT,
                }
                for serial in serials
            ],
        )


@pytest.fixture
def many(service: Service) -> None:
    """A database with 230 units, recordings and campaigns."""
    store = service.lab_service.store
    for _ in range(ROWS):
        store.campaigns.create(NewCampaign("short", {}, "single-axis-sim", {}, "hash", 60.0, [STEP], ()), AT)
    with store._database.writing() as connection:
        connection.execute(sa.update(tables.campaigns).values(state="done"))
    add_units(service, [f"G{k:03d}" for k in range(ROWS)])


@pytest.mark.usefixtures("many")
@pytest.mark.parametrize("what", ["units", "recordings", "campaigns"])
def test_a_long_list_is_shown_in_parts_and_searched_whole(visit: Callable[..., Page], what: str) -> None:
    from playwright.sync_api import expect

    page = visit(f"/{what}")
    rows = page.get_by_role("main").locator("tbody tr")
    expect(rows).to_have_count(100)
    expect(page.get_by_text(f"100 of {ROWS} {what}")).to_be_visible()
    page.get_by_role("button", name="Show 100 more").click()
    expect(rows).to_have_count(200)
    page.get_by_role("button", name="Show 100 more").click()
    expect(rows).to_have_count(ROWS)
    expect(page.get_by_role("button", name="Show 100 more")).to_be_hidden()
    names = rows.locator("td:first-child a").all_inner_texts()
    assert len(set(names)) == ROWS


@pytest.mark.slow
@pytest.mark.usefixtures("many")
def test_a_search_is_in_the_address_and_finds_what_was_not_shown(visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    page = visit("/units")
    rows = page.get_by_role("main").locator("tbody tr")
    expect(rows).to_have_count(100)
    page.get_by_label("Search units").fill("g22")
    expect(rows).to_have_count(10)
    expect(page.get_by_text("10 of 10 units found")).to_be_visible()
    assert page.url.endswith("/units?search=g22")
    page.reload()
    expect(rows).to_have_count(10)
    expect(page.get_by_label("Search units")).to_have_value("g22")
    page.get_by_label("Search units").fill("nosuch")
    expect(page.get_by_text("No units hold “nosuch”.")).to_be_visible()


def test_units_have_the_same_order_in_every_list(service: Service, visit: Callable[..., Page]) -> None:
    serials = ["AA2", "A-10", "A-02", "Aa2", "A-2", "A.2", "A-002"]
    add_units(service, serials)
    ordered = [row["serial"] for row in service.get("/api/units")]
    assert ordered == ["A-2", "A-02", "A-002", "A-10", "A.2", "AA2", "Aa2"]
    page = visit("/units")
    page.get_by_role("main").locator("tbody tr").nth(6).wait_for()
    assert page.get_by_role("main").locator("tbody tr td:first-child").all_inner_texts() == ordered
    page = visit("/explore?unit=A-10")
    choice = page.get_by_label("Unit")
    choice.wait_for()
    assert choice.locator("option").all_inner_texts() == ordered
    assert choice.input_value() == "A-10"


@pytest.mark.slow
@pytest.mark.usefixtures("many")
def test_a_choice_is_in_the_address_and_goes_with_a_search(visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    page = visit("/units?calibration=none&search=g22")
    rows = page.get_by_role("main").locator("tbody tr")
    expect(rows).to_have_count(10)
    expect(page.get_by_label("Calibration")).to_have_value("none")
    page.get_by_label("Search units").fill("")
    expect(page.get_by_text(f"100 of {ROWS} units found")).to_be_visible()
    page.get_by_role("button", name="Show 100 more").click()
    expect(rows).to_have_count(200)
    page.get_by_label("Calibration").select_option("in_force")
    expect(page.get_by_text("No units are as chosen.")).to_be_visible()
    assert page.url.endswith("/units?calibration=in_force")
    page.get_by_label("Calibration").select_option("")
    expect(page.get_by_text(f"100 of {ROWS} units")).to_be_visible()
    assert page.url.endswith("/units")


@pytest.mark.slow
def test_the_version_in_force_stands_before_the_newest_ones(service: Service, visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    made = service.post("/api/recordings/simulated", {"serial": "FOG-0001", "recipe": "short"})
    fit = {"recording": made["recording"], "effects": ["bias", "scale_factor"]}
    for _ in range(13):
        service.post("/api/units/FOG-0001/calibrations", fit)
    service.post("/api/units/FOG-0001/calibrations/2/certify", {"by": "Ada", **OVERRIDE})
    page = visit("/units/FOG-0001")
    card = page.get_by_role("region", name="Calibrations", exact=True)
    rows = card.locator("tbody tr")
    expect(rows).to_have_count(10)
    first = rows.locator("td:first-child a")
    assert first.all_inner_texts() == [str(version) for version in (2, 13, 12, 11, 10, 9, 8, 7, 6, 5)]
    expect(rows.first).to_contain_text("in force")
    expect(card.get_by_role("status").filter(has_text="versions")).to_have_text("10 of 13 versions")
    card.get_by_role("button", name="Show 3 earlier").click()
    expect(rows).to_have_count(13)
    assert first.all_inner_texts()[10:] == ["4", "3", "1"]
    expect(card.get_by_role("status").filter(has_text="versions")).to_have_count(0)


@pytest.mark.slow
@pytest.mark.usefixtures("many")
@pytest.mark.parametrize(
    ("address", "said"),
    [
        ("/explore?unit=NOPE", "unit 'NOPE' is not in this database"),
        ("/explore?unit=G001&version=999", "999"),
    ],
)
def test_an_address_of_what_is_not_there_says_so(
    visit: Callable[..., Page], faults: list[str], address: str, said: str
) -> None:
    from playwright.sync_api import expect

    page = visit(address)
    expect(page.get_by_role("main")).to_contain_text(said)
    assert page.locator(".plot").count() == 0
    faults.clear()  # the browser reports the 404 that the page is about


@pytest.mark.slow
@pytest.mark.usefixtures("many")
def test_the_batch_of_a_unit_is_stated_on_its_page_and_filters_the_list(
    visit: Callable[..., Page], service: Service
) -> None:
    from playwright.sync_api import expect

    service.post("/api/batches", {"batch": "26-W12", "serials": ["G001", "G002"], "by": "Q"})
    page = visit("/units/G003")
    page.get_by_role("button", name="Set batch").click()
    page.get_by_label("Batch", exact=True).fill("26-W12")
    page.get_by_label("Supplier").fill("ACME")
    page.get_by_label("Who").fill("Q")
    page.get_by_role("dialog").get_by_role("button", name="Set batch").click()
    expect(page.get_by_text("VG-35 · FOG · batch 26-W12 · ACME")).to_be_visible()
    page = visit("/units")
    page.get_by_label("Batch", exact=True).select_option("26-W12")
    expect(page.get_by_role("main").locator("tbody tr")).to_have_count(3)
    assert page.url.endswith("/units?batch=26-W12")
    page.reload()
    expect(page.get_by_text("3 of 3 units found")).to_be_visible()


@pytest.mark.slow
@pytest.mark.usefixtures("many")
def test_pages_that_show_a_part_of_a_list_say_so_and_find_the_rest(
    service: Service, visit: Callable[..., Page]
) -> None:
    from playwright.sync_api import expect

    made = {"version": 1, "model": "cubic", "document": b"{}", "answer": {}, "created_at": AT}
    act = {"version": 1, "act": "certify", "by": "Ada", "reason": "", "at": AT, "due_at": AT}
    due = [f"G{k:03d}" for k in range(50, 65)]
    with service.lab_service.store._database.writing() as connection:
        connection.execute(sa.insert(tables.calibrations), [{**made, "serial": each, "hash": each} for each in due])
        connection.execute(sa.insert(tables.certifications), [{**act, "serial": each} for each in due])
        connection.execute(sa.update(tables.recordings).values(kind="samples"))
    page = visit("/")
    listed = page.get_by_role("list", name="Units that are due").get_by_role("listitem")
    expect(listed).to_have_count(11)
    expect(listed.first).to_contain_text("G050")
    expect(listed.last).to_contain_text("5 more units are due or overdue.")
    listed.last.get_by_role("link").click()
    expect(page.get_by_text(f"{len(due)} of {len(due)} units found")).to_be_visible()

    page = visit("/noise?recordings=7")  # far behind the first part
    boxes = page.get_by_role("checkbox")
    expect(boxes).to_have_count(101)
    expect(page.get_by_label("Recording 7, G006")).to_be_checked()
    page.get_by_label("Search recordings").fill("g003")
    expect(page.get_by_label("Recording 4, G003")).not_to_be_checked()
    expect(page.get_by_label("Recording 7, G006")).to_be_checked()
    expect(boxes).to_have_count(2)
    page.get_by_label("Recording 7, G006").uncheck()
    page.get_by_label("Recording 4, G003").check()
    assert "recordings=4" in page.url

"""A log of another format is dropped on the page, its map corrected, and imported."""

from __future__ import annotations

import base64
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from tests.helpers.browser import Faults, Service
from tests.helpers.written_logs import at_rest, csv_text, moved, resting_ulog, spiked_on_table

if TYPE_CHECKING:
    from playwright.sync_api import Page


DROP = """async ([name, coded]) => {
  const bytes = Uint8Array.from(atob(coded), (character) => character.charCodeAt(0));
  const transfer = new DataTransfer();
  transfer.items.add(new File([bytes], name));
  const drop = new DragEvent("drop", { dataTransfer: transfer, bubbles: true, cancelable: true });
  document.querySelector(".drop").dispatchEvent(drop);
}"""


def drop(page: Page, name: str, content: bytes) -> None:
    page.locator(".drop").wait_for()
    page.evaluate(DROP, [name, base64.b64encode(content).decode()])


def test_a_csv_is_dropped_its_map_corrected_and_imported(service: Service, visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    page = visit("/recordings")
    drop(page, "chamber.csv", csv_text(at_rest(), "time (s),gyro_x,gyro_y,gyro_z,temperature (degC)").encode())
    expect(page.get_by_role("alert")).to_contain_text("column 'gyro_x'")
    expect(page.get_by_role("alert")).to_contain_text("no unit is given")
    expect(page.get_by_role("button", name="Import", exact=True)).to_be_disabled()
    expect(page.get_by_role("group", name="First rows")).to_contain_text("25.000000")
    assert service.get("/api/recordings") == []
    for axis in "xyz":
        page.get_by_label(f"Unit of gyro_{axis}").select_option("deg/s")
        page.get_by_label(f"Unit of gyro_{axis}").wait_for()
        expect(page.get_by_label(f"Unit of gyro_{axis}")).to_have_value("deg/s")
    expect(page.get_by_text("Unit chamber, motion rest, 1 data set")).to_be_visible()
    page.get_by_label("Serial number").fill("CHAMBER-7")
    page.get_by_label("Serial number").press("Tab")
    expect(page.get_by_text("Unit CHAMBER-7, motion rest")).to_be_visible()
    page.get_by_role("group", name="Columns of chamber.csv").scroll_into_view_if_needed()
    page.locator(".plot .main-svg").first.wait_for()
    page.get_by_role("button", name="Import", exact=True).click()
    expect(page.get_by_text("Imported as recording 1 of unit CHAMBER-7: 1 data sets, 400 readings")).to_be_visible()
    (row,) = service.get("/api/recordings")
    assert row["serial"] == "CHAMBER-7"
    assert service.get("/api/recordings/1")["info"]["motion"] == "rest"


def test_a_ulog_is_dropped_and_imported_as_it_is_proposed(
    service: Service, visit: Callable[..., Page], tmp_path: Path
) -> None:
    from playwright.sync_api import expect

    page = visit("/recordings")
    drop(page, "cold_start.ulg", resting_ulog(tmp_path / "cold_start.ulg").read_bytes())
    expect(page.get_by_text("cold_start.ulg: a PX4 ULog, 400 rows")).to_be_visible()
    expect(page.get_by_text("Unit 00ab12cd-0, motion rest, 1 data set")).to_be_visible()
    page.get_by_role("button", name="Import", exact=True).click()
    expect(page.get_by_text("Imported as recording 1 of unit 00ab12cd-0: 1 data sets, 400 readings")).to_be_visible()


def test_free_motion_is_refused_on_the_page_too(service: Service, visit: Callable[..., Page], faults: Faults) -> None:
    from playwright.sync_api import expect

    page = visit("/recordings")
    drop(page, "flight.csv", csv_text(moved()).encode())
    expect(page.get_by_role("alert")).to_contain_text("free motion without a reference cannot calibrate a gyro")
    drop(page, "empty.csv", b"")
    expect(page.get_by_role("alert")).to_contain_text("the file is empty")
    assert service.get("/api/recordings") == []
    faults.clear()  # the browser notes the refusal as an error


def test_readings_of_a_rate_table_are_left_out_by_choice(service: Service, visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    page = visit("/recordings")
    drop(page, "table.csv", spiked_on_table().encode())
    choices = page.get_by_role("group", name="Leave out of every fit (the readings are kept)")
    choices.get_by_label("spikes: 3 of gyro_z (of 2,000 readings)").check()
    page.get_by_role("button", name="Import", exact=True).click()
    expect(page.get_by_text("Left out: 3 of 2,000 readings of gyro_z (3 single readings are far from")).to_be_visible()
    assert service.get("/api/recordings/1/inspection")["left_out"][0]["n"] == 3
    page.get_by_role("link", name="Show it").click()
    expect(page.get_by_text("Left out: 3 of 2,000 readings of gyro_z")).to_be_visible()

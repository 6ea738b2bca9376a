"""Noise at rest of several recordings over each other."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import httpx

from labctl.recording import write_recording
from tests.helpers.browser import Faults, Service
from tests.helpers.patience import WAIT_S
from tests.helpers.rest import at_rest

if TYPE_CHECKING:
    from playwright.sync_api import Page


def test_two_records_are_drawn_over_each_other_with_the_data_sheet(
    service: Service, visit: Callable[..., Page], tmp_path: Path
) -> None:
    from playwright.sync_api import expect

    for serial in ("A-1", "B-2"):
        folder = tmp_path / serial
        sheet = {"bias_stability_dps": 0.002}
        write_recording(at_rest(("z",), thermometer=False, minutes=20.0, serial=serial, datasheet=sheet), folder, "csv")
        files = [("files", (file.name, file.read_bytes())) for file in sorted(folder.iterdir())]
        httpx.post(f"{service.url}/api/recordings", files=files, timeout=WAIT_S).raise_for_status()
    page = visit("/recordings")
    page.get_by_role("link", name="Compare noise at rest").click()
    page.get_by_label("Recording 1, A-1").check()
    page.get_by_label("Recording 2, B-2").check()
    expect(page.get_by_role("region", name="Allan deviation").get_by_role("row")).to_have_count(3)
    assert "recordings=1%2C2" in page.url
    page.get_by_label("Recording 2, B-2").uncheck()
    page.get_by_label("Recording 2, B-2").check()
    page.reload()
    expect(page.get_by_label("Recording 2, B-2")).to_be_checked()
    expect(page.get_by_text("B-2, data sheet", exact=True)).to_be_visible()


def test_what_cannot_be_drawn_is_counted_and_the_reason_is_said(
    service: Service, visit: Callable[..., Page], tmp_path: Path, faults: Faults
) -> None:
    from playwright.sync_api import expect

    folder = tmp_path / "A-1"
    write_recording(at_rest(("z",), thermometer=False, minutes=20.0, serial="A-1"), folder, "csv")
    files = [("files", (file.name, file.read_bytes())) for file in sorted(folder.iterdir())]
    httpx.post(f"{service.url}/api/recordings", files=files, timeout=WAIT_S).raise_for_status()
    service.post("/api/recordings/example", {"name": "osu-fog"})
    page = visit("/noise?recordings=1,2,99")
    card = page.get_by_role("region", name="Allan deviation")
    expect(card).to_contain_text("1 of 3 recordings are drawn.")
    expect(card).to_contain_text("Recording 2: it holds only means of data sets")
    expect(card).to_contain_text("Recording 99: ")
    expect(card.get_by_role("row")).to_have_count(2)
    faults.clear()  # the browser itself logs that there is no recording 99

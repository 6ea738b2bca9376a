"""Importing recordings and showing them, down to the readings."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.helpers.browser import NARROW, Faults, Service

if TYPE_CHECKING:
    from playwright.sync_api import Page

FOG = Path(str(resources.files("labctl"))) / "examples" / "osu-fog"

DROP = """async (files) => {
  const transfer = new DataTransfer();
  for (const [name, text] of files) transfer.items.add(new File([text], name));
  const drop = new DragEvent("drop", { dataTransfer: transfer, bubbles: true, cancelable: true });
  document.querySelector(".drop").dispatchEvent(drop);
}"""

UNDRAWN = """async (ids) => {
  const { signature } = await import("/static/js/effects/signatures.js");
  return ids.filter((id) => !signature(id));
}"""


def dropped(page: Page, folder: Path, names: list[str]) -> None:
    page.locator(".drop").wait_for()
    page.evaluate(DROP, [[name, (folder / name).read_text()] for name in names])


def test_a_recording_is_dropped_and_opened(service: Service, visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    page = visit("/recordings")
    dropped(page, FOG, ["recording.toml", "points.csv"])
    expect(page.get_by_text("Imported as recording 1 of unit OSU-FOG-2024: 695 data sets")).to_be_visible()
    page.get_by_role("link", name="Show it").click()
    expect(page.get_by_role("region", name="695 data sets").first).to_be_visible()
    page.get_by_role("button", name="7", exact=True).click()
    assert "dataset=7" in page.url
    expect(page.get_by_role("region", name="Data set 7").first).to_contain_text("deg/s")
    page.reload()
    expect(page.get_by_role("region", name="Data set 7").first).to_be_visible()
    with page.expect_download() as download:
        page.get_by_role("button", name="Save as CSV").click()
    assert download.value.path().read_bytes()[:2] == b"PK"


def test_a_wrong_file_is_refused_with_its_row(
    service: Service, visit: Callable[..., Page], tmp_path: Path, faults: Faults
) -> None:
    from playwright.sync_api import expect

    bad = shutil.copytree(FOG, tmp_path / "bad")
    lines = (bad / "points.csv").read_text().splitlines()
    lines[5] = ",".join([*lines[5].split(",")[:-1], "abc"])
    (bad / "points.csv").write_text("\n".join(lines) + "\n")
    page = visit("/recordings", size=NARROW)
    dropped(page, bad, ["recording.toml", "points.csv"])
    expect(page.get_by_role("alert")).to_contain_text("points.csv")
    expect(page.get_by_role("alert")).to_contain_text("gyro_z")
    expect(page.get_by_role("alert")).to_contain_text("abc")
    dropped(page, FOG, ["README.md"])
    expect(page.get_by_role("alert")).to_contain_text("README.md")
    assert service.get("/api/recordings") == []
    faults.clear()  # the browser notes each refusal as an error


#: Long enough at rest for an Allan deviation.
RECIPE = """format = "labctl-recipe/1"
name = "rest"
temperatures_c = [25]
rates_dps = [0, 20, -20]
positions = ["z"]
[soak]
hold_s = 60
[acquire]
duration_s = 60
settle_s = 2
"""


@pytest.mark.slow
def test_traces_are_looked_at_more_closely_down_to_the_readings(service: Service, visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    made = service.post("/api/recordings/simulated", {"recipe": RECIPE})
    page = visit(f"/recordings/{made['recording']}")
    trace = page.get_by_role("region", name="Trace")
    expect(trace).to_contain_text("readings")
    trace.get_by_role("button", name="Zoom in").click()
    page.wait_for_url("**from=**")
    trace.get_by_label("Channel").select_option("temperature_c")
    page.wait_for_url("**channel=temperature_c**")
    page.get_by_role("button", name="3", exact=True).click()
    expect(page.get_by_role("region", name="Data set 3").first).to_contain_text("readings as numbers")
    expect(page.get_by_role("region", name="Noise at rest")).to_contain_text("angle random walk")


def test_every_effect_has_a_page_of_its_own(service: Service, visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    page = visit("/effects", dark=True)
    page.get_by_label("Search").fill("upside gravity")
    page.get_by_label("Search").fill("magnetic")
    page.get_by_role("link", name="Magnetic sensitivity").click()
    expect(page.locator("main")).to_contain_text("one cycle per turn")
    expect(page.get_by_role("region", name="How large it is")).to_contain_text("deg/s")
    expect(page.get_by_role("region", name="Effects that look the same")).to_contain_text("Earth rate")
    known = [each["id"] for each in service.get("/api/effects")["effects"]]
    assert page.evaluate(UNDRAWN, known) == []

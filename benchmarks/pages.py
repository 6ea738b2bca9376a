"""The pages in a browser beside 10,000 units: first views, a map of 630 data sets after a pick, a trace of 4.7 million
readings."""

from __future__ import annotations

import statistics
import tempfile
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING

import httpx

from benchmarks import lists
from benchmarks.browser import Chromium, chromium, marked_s, moved_kb, opened, version
from benchmarks.machine import describe, processor_s
from benchmarks.served import Served, serve
from labctl.answers.campaigns import StartRequest
from labctl.services.campaigns.execution import run_here
from labctl.store import Store
from labctl.store.connection.database import Database

if TYPE_CHECKING:
    from playwright.sync_api import Page

#: Limits that the project has set itself.
LIMITS = {
    "first_view_s": 1.0, "outlined_after_pick_ms": 100.0, "trace_s": 1.0, "first_view_kb": 1500.0,
    "later_view_kb": 50.0,
}  # fmt: skip
RUNS = 5
#: On a busy machine a fit of 4.7 million readings takes minutes.
PATIENCE_S = 900.0
#: Pages, and what they mark when they are seen: the page itself or, where it is about one, its first picture.
VIEWS = {
    "start": ("/", "labctl:page"),
    "bench": ("/bench", "labctl:page"),
    "campaigns": ("/campaigns", "labctl:page"),
    "campaign": ("/campaigns/1", "labctl:picture"),
    "units": ("/units", "labctl:page"),
    "unit": ("/units/{serial}", "labctl:picture"),
    "explore": ("/explore?unit={serial}", "labctl:picture"),
    "recordings": ("/recordings", "labctl:page"),
    "recording": ("/recordings/{recording}", "labctl:picture"),
    "noise": ("/noise", "labctl:page"),
    "fleet": ("/fleet", "labctl:page"),
    "effects": ("/effects", "labctl:page"),
}
#: Note when the mouse was pressed last; when the frame that outlines what it picked was drawn, and the pictures.
WATCH = """() => {
  addEventListener("mousedown", () => { window.pressed = performance.now(); performance.clearMarks(); }, true);
}"""
SINCE_PRESSED = """() => {
  const drawn = performance.getEntriesByName("labctl:picture").map((entry) => entry.startTime - window.pressed);
  const [outlined] = performance.getEntriesByName("labctl:outlined");
  return {
    outlined: outlined ? outlined.startTime - window.pressed : null,
    first: Math.min(...drawn), last: Math.max(...drawn), pictures: drawn.length,
  };
}"""
SETTLED_MS = 1500


def run() -> dict[str, float | str]:
    """Measure over loopback: first views in browsers with empty caches, the rest in one browser."""
    with tempfile.TemporaryDirectory() as folder:
        location = Path(folder) / "lab.sqlite"
        serial, recording = next(
            iter(run_here(str(location), StartRequest(recipe="table1-x-table2")).recordings.items())
        )
        with closing(Database(str(location), write=True)) as database:
            lists.fill(Store(database), database)
        with serve(location) as service, chromium() as browser:
            calibrations = f"{service.url}/api/units/{serial}/calibrations"
            httpx.post(calibrations, json={"model": "yang2018"}, timeout=PATIENCE_S).raise_for_status()
            httpx.get(
                f"{calibrations}/1/criticism", timeout=PATIENCE_S
            ).raise_for_status()  # the criticism is in the cache
            figures = {
                **_trace(browser, f"{service.url}/recordings?unit={serial}", recording),
                **_pick(browser, f"{service.url}/explore?unit={serial}"),
                **_first_views(service, serial, recording),
            }
            name = version(browser)
    return {**describe("plotly", "fastapi", "uvicorn", "sqlalchemy"), "browser": name, **figures}


def _first_views(service: Served, serial: str, recording: int) -> dict[str, float]:
    """Return the seconds from asking for each page until it is seen, and the kB that it and a later view moved.

    Seconds are medians, each time in a new browser; those of the processor are of the browser and of the service, from
    asking for the page until it stands still.
    """
    found = {}
    for name, (path, mark) in VIEWS.items():
        url = service.url + path.format(serial=serial, recording=recording)
        times, taken = [], []
        for _ in range(RUNS):
            with chromium() as browser:
                before_s = [processor_s(each) for each in (browser.process, service.process)]
                with opened(browser, url) as page:
                    after_s = [processor_s(each) for each in (browser.process, service.process)]
                    times.append(marked_s(page, mark))
                    taken.append([after - before for after, before in zip(after_s, before_s, strict=True)])
                    first_kb = moved_kb(page)
                    page.reload(wait_until="networkidle")
                    later_kb = moved_kb(page)
        found[f"first_view_{name}_s"] = statistics.median(times)
        for where, each in zip(("browser", "service"), zip(*taken, strict=True), strict=True):
            found[f"first_view_{name}_{where}_processor_s"] = statistics.median(each)
        found |= {f"first_view_{name}_kb": first_kb, f"later_view_{name}_kb": later_kb}
    return found


def _trace(browser: Chromium, url: str, recording: int) -> dict[str, float]:
    """Open a recording from the list of its unit's: the first time ever, and again."""
    with opened(browser, url) as page:
        page.evaluate(WATCH)
        times = []
        for _ in range(1 + RUNS):
            page.locator(f"main a[href='/recordings/{recording}']").first.click()
            page.wait_for_timeout(SETTLED_MS)
            times.append(page.evaluate(SINCE_PRESSED)["first"] / 1e3)
            page.go_back()
            page.wait_for_timeout(SETTLED_MS)
    return {"trace_first_s": times[0], "trace_again_s": statistics.median(times[1:])}


def _pick(browser: Chromium, url: str) -> dict[str, float]:
    """Press cells of the map; returns how soon the picked cell is outlined, and the pictures are drawn again, ms."""
    with opened(browser, url) as page:
        plot = page.get_by_role("region", name="Where the model fails").locator(".plot").first
        plot.scroll_into_view_if_needed()
        page.wait_for_timeout(SETTLED_MS)
        page.evaluate(WATCH)
        found = [_pressed(page, plot.bounding_box() or {}, k) for k in range(RUNS)]
    return {
        "outlined_after_pick_ms": statistics.median(each["outlined"] for each in found),
        "redraw_after_pick_ms": statistics.median(each["first"] for each in found),
        "all_redrawn_after_pick_ms": statistics.median(each["last"] for each in found),
        "pictures_redrawn": float(found[-1]["pictures"]),
    }


def _pressed(page: Page, box: dict[str, float], k: int) -> dict[str, float]:
    page.mouse.click(box["x"] + (0.1 + 0.04 * k) * box["width"], box["y"] + 0.4 * box["height"])
    page.wait_for_timeout(SETTLED_MS)
    times: dict[str, float] = page.evaluate(SINCE_PRESSED)
    return times

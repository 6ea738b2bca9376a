"""A limit that trips while the page is open: its strip turns amber, then red, and so do title and icon of the tab."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from instruments.bench_config import shipped_benches
from tests.helpers.browser import POLL_MS, Service, number_of
from tests.helpers.paced_hand import PacedClock

if TYPE_CHECKING:
    from playwright.sync_api import Page

#: The unit warms itself by a kelvin: in air of 33 deg C it passes its limit, and the campaign goes on with a warning.
MAX_C = 33.1
RECIPE = """format = "labctl-recipe/1"
name = "warm"
temperatures_c = [33]
rates_dps = [-40, 0, 40]
positions = ["z"]
repeats = 60
[soak]
hold_s = 60
max_drift_c = 5.0
drift_window_s = 30
[acquire]
duration_s = 10
[guards]
gyro_margin_c = 0
[guards.actions]
unit_temperature = "warn"
"""
#: Keep each state of the strip with the title and the icon of the tab, once.
WATCH = """() => {
  window.seen = [];
  setInterval(() => {
    const strip = document.querySelector('[data-kind="unit_temperature"]');
    const icon = document.querySelector('link[rel="icon"]').getAttribute("href");
    const now = [
      strip?.className, strip?.querySelector(".limit-value").textContent, document.title,
      /alarm/.test(icon), strip?.querySelector(".limit-distance").textContent,
    ];
    if (strip && window.seen.at(-1)?.join() !== now.join()) window.seen.push(now);
  }, 20);
}"""


@pytest.fixture
def service(tmp_path: Path) -> Iterator[Service]:
    """A bench whose unit may be no warmer than the recipe lets its air be."""
    text = shipped_benches()["triaxial-sim"].read_text(encoding="utf-8")
    assert "max_c = 85" in text
    bench = tmp_path / "narrow.toml"
    bench.write_text(text.replace("min_c = -40", "min_c = 0").replace("max_c = 85", f"max_c = {MAX_C}"), "utf-8")
    serving = Service(tmp_path, bench=str(bench), clock=PacedClock)
    serving.start()
    yield serving
    serving.stop()


@pytest.mark.slow
def test_a_strip_turns_amber_and_then_red_with_the_tab(service: Service, visit: Callable[..., Page]) -> None:
    service.post("/api/campaigns", {"recipe": RECIPE})
    page = visit("/bench")
    page.locator('[data-kind="unit_temperature"]').wait_for()
    page.evaluate(WATCH)
    page.wait_for_function(
        "window.seen.some(([state, , title]) => state.endsWith('bad') && title.startsWith('LIMIT'))", polling=POLL_MS
    )
    (watched,) = (each for each in service.get("/api/campaigns/1")["limits"] if each["kind"] == "unit_temperature")
    service.post("/api/campaigns/1/abort", {"reason": "seen"})
    assert watched["high"] == MAX_C
    assert watched["is_beyond"] is True
    seen = page.evaluate("window.seen")
    levels = [state.removeprefix("limit-strip ") for state, *_ in seen]
    assert list(dict.fromkeys(levels)) == ["good", "warn", "bad"]
    for level, (_, value, title, is_red, distance) in zip(levels, seen, strict=True):
        temperature_c = number_of(value.split()[0])
        share = abs(temperature_c - MAX_C / 2) / (MAX_C / 2)
        assert (level == "bad") == ("BEYOND" in distance)
        if level == "good":
            assert share < 0.8 + 0.01
        if level == "warn":
            assert 0.8 - 0.01 <= share <= 1.0 + 0.01
        if level == "bad":
            assert temperature_c >= MAX_C - 0.06
            assert is_red
        else:
            assert "LIMIT" not in title
            assert is_red == title.startswith("Stale")  # which a service on a busy computer may be meanwhile
    assert any(title.startswith("LIMIT mems") for _, _, title, _, _ in seen)

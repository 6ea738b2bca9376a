"""The picture of the last check on the bench page: what is drawn is what the check answered."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
import tomli_w

from instruments.bench_config import read_bench
from tests.helpers.browser import NARROW, Service, on_page

if TYPE_CHECKING:
    from playwright.sync_api import Page

WORDS = {"good": "in order", "doubtful": "doubtful", "bad": "wrong"}
DRAWN = """() => [...document.querySelectorAll(".wiring-row")].map((row) => ({
  device: row.querySelector("strong").textContent,
  word: row.querySelector(".chip").textContent,
  state: row.dataset.state,
  port: row.querySelector(".wiring-port").textContent,
  findings: [...row.querySelectorAll(".finding")].map((each) => each.textContent),
}))"""


@pytest.fixture
def service(tmp_path: Path) -> Iterator[Service]:
    """A bench with a port that is not there, and a unit that sends angles."""
    record: dict[str, Any] = read_bench("single-axis-sim").model_dump(mode="json", exclude_none=True)
    unit = {"driver": "stim300", "max_rate_dps": 400.0, "axes": ["x", "y", "z"]}
    record["gyros"] += [
        {"name": "angle", "serial": "A1", "port": "sim://stim300/angle", **unit},
        {"name": "gone", "serial": "G1", "port": "/dev/no-such-port", **unit},
    ]
    record["simulation"]["units"] = {"angle": {"device": {"output_unit": "incremental"}}}
    bench = tmp_path / "bench.toml"
    bench.write_text(tomli_w.dumps(record), encoding="utf-8")
    serving = Service(tmp_path, bench=str(bench))
    serving.start()
    yield serving
    serving.stop()


def test_what_is_drawn_is_what_the_check_answered(service: Service, visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    page = visit("/bench")
    card = page.get_by_role("region", name="Check of the bench")
    expect(card).to_contain_text("The bench was not checked since the service was started.")
    card.get_by_role("button", name="Check the bench").click()
    expect(card).to_contain_text("5 instruments: 2 wrong, 0 doubtful.")
    answer = service.get("/api/benches")[0]["check"]
    assert [each["state"] for each in answer["devices"]] == ["good", "good", "good", "bad", "bad"]
    expected = [
        {
            "device": each["device"],
            "word": WORDS[each["state"]],
            "state": each["state"],
            "port": each["address"],
            "findings": [
                *(on_page(finding["text"]) for finding in each["findings"] if finding["state"] != "good"),
                *(on_page(finding["text"]) for finding in each["findings"] if finding["state"] == "good"),
            ],
        }
        for each in answer["devices"]
    ]
    assert page.evaluate(DRAWN) == expected
    again = visit("/bench", size=NARROW)
    expect(again.get_by_role("region", name="Check of the bench")).to_contain_text("5 instruments: 2 wrong")
    assert again.evaluate(DRAWN) == expected
    assert again.evaluate("document.documentElement.scrollWidth <= window.innerWidth")

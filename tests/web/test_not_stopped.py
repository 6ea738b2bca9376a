"""A stop that does not arrive: the page says so over everything until the table stands, and the bench's own page stops.

What counts is what a person at the table reads, and that the stop is asked for until it is confirmed.
"""

from __future__ import annotations

import json
import os
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import httpx
import pytest

from labctl.answers.admin import KeyRequest, Role
from labctl.services.campaigns import preparation
from labctl.services.commands.registry import CREATE_KEY
from tests.helpers.browser import NARROW, PATIENCE_MS, WIDE, Faults, Service
from tests.helpers.forked_commands import run_labctl
from tests.helpers.paced_hand import PacedClock, PacedPerson
from tests.helpers.paths import RECIPES
from tests.helpers.patience import WAIT_S
from tests.helpers.processes import ServiceProcess, running
from tests.helpers.simulator_process import FIRST_DPS, RECIPE
from tests.helpers.waiting import before_next_request

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page, Route


TITLE = "NOT STOPPED. Use the stop switch."
ABORT = "**/api/campaigns/1/abort"
LONG = (RECIPES / "short.toml").read_text(encoding="utf-8").replace("[soak]", "repeats = 100\n[soak]")
#: Whether the message lies over a page at nine points of the viewport, is whole, and can be read.
PLAIN = """() => {
  const over = document.querySelector("[data-not-stopped]");
  if (!over) return false;
  const places = [0.02, 0.5, 0.98].flatMap((x) => [0.02, 0.5, 0.98].map((y) => [x * innerWidth, y * innerHeight]));
  const title = over.querySelector("strong");
  const box = title.getBoundingClientRect();
  return places.every(([x, y]) => over.contains(document.elementFromPoint(x, y)))
    && box.left >= 0 && box.right <= innerWidth && box.top >= 0 && box.bottom <= innerHeight
    && parseFloat(getComputedStyle(title).fontSize) >= 40;
}"""


@pytest.fixture
def service(waiting: Service) -> Service:
    return waiting


def begin(service: Service) -> None:
    service.post("/api/campaigns", {"recipe": LONG})
    service.until("/api/campaigns/1", lambda answer: answer["prompt"] is not None)


def press_stop(page: Page) -> None:
    page.get_by_role("button", name="Safe stop").click()
    page.get_by_role("dialog").get_by_role("button", name="Stop now").click()


WAYS: dict[str, Callable[[Route], object]] = {
    "refused": lambda route: route.abort("connectionrefused"),
    "a proxy's page": lambda route: route.fulfill(status=503, content_type="text/html", body="<h1>Sorry</h1>"),
    "a page that says well": lambda route: route.fulfill(status=200, content_type="text/html", body="<h1>Hi</h1>"),
    "no answer": lambda route: None,
    "pass": lambda route: route.continue_(),
}


class Failing:
    """Answers requests for a stop in the way that is set, until they may pass."""

    def __init__(self, page: Page) -> None:
        self.page, self.way = page, "refused"
        page.context.route(ABORT, self._answer)

    def _answer(self, route: Route) -> None:
        WAYS[self.way](route)

    def turn_to(self, way: str) -> None:
        """Answer so from now on, and wait until that has happened twice."""
        self.way = way
        for _ in range(2):
            with self.page.expect_request(ABORT):
                pass


@pytest.mark.slow
@pytest.mark.parametrize(
    ("size", "ways"), [(WIDE, ("a proxy's page", "a page that says well", "no answer", "refused")), (NARROW, ())]
)
def test_whatever_answers_in_place_of_the_service_the_page_says_not_stopped_until_the_table_stands(
    service: Service, visit: Callable[..., Page], faults: Faults, size: dict[str, int], ways: tuple[str, ...]
) -> None:
    from playwright.sync_api import expect

    begin(service)
    page = visit("/bench", size=size, dark=size is NARROW, alone=True)
    failing = Failing(page)
    press_stop(page)
    over = page.get_by_role("alertdialog")
    expect(over).to_contain_text(TITLE)
    page.wait_for_function(PLAIN)
    for way in ways:
        failing.turn_to(way)
        assert page.evaluate(PLAIN), way
        page.keyboard.press("Escape")
    page.goto(f"{service.url}/units")  # another page of the tab asks on
    page.wait_for_function(PLAIN)
    assert service.get("/api/campaigns/1")["state"] != "aborted"
    failing.way = "pass"
    expect(page.locator(".toasts")).to_contain_text("Stopped. The table stands")
    expect(over).to_have_count(0)
    assert service.get("/api/campaigns/1")["state"] == "aborted"
    faults.clear()  # the browser itself logs each answer that fails


@pytest.mark.slow
def test_a_key_that_may_not_stop_is_said_and_another_one_stops(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, chromium: Browser
) -> None:
    from playwright.sync_api import expect

    monkeypatch.setattr(preparation, "operator_of", lambda _: PacedPerson())
    service = Service(tmp_path, keys=True, clock=PacedClock)
    service.start()
    try:
        viewer, operator = (
            service.lab_service.execute(CREATE_KEY, KeyRequest(name=role.name.lower(), role=role)).key
            for role in (Role.VIEWER, Role.OPERATOR)
        )
        headers = {"Authorization": f"Bearer {operator}"}
        httpx.post(f"{service.url}/api/campaigns", json={"recipe": LONG}, headers=headers, timeout=WAIT_S)
        context = chromium.new_context()
        context.set_default_timeout(PATIENCE_MS)
        context.add_init_script(
            f"sessionStorage.getItem('labctl.key') ?? sessionStorage.setItem('labctl.key', '{viewer}')"
        )
        page = context.new_page()
        page.goto(f"{service.url}/bench")
        press_stop(page)
        over = page.get_by_role("alertdialog")
        expect(over).to_contain_text("labctl refuses the stop")
        over.get_by_role("button", name="Use another key").click()
        asked = page.get_by_role("dialog")
        asked.get_by_label("Key").fill(operator)
        asked.get_by_role("button", name="Use it").click()
        expect(page.locator(".toasts")).to_contain_text("Stopped. The table stands")
        expect(over).to_have_count(0)
        context.close()
    finally:
        service.stop()


@pytest.fixture
def context_of(chromium: Browser) -> Iterator[Callable[..., Page]]:
    """Open a page in a browser of its own: `context_of(url, java_script_enabled=False)`."""
    contexts = []

    def opened(url: str, **options: object) -> Page:
        contexts.append(chromium.new_context(**options))  # type: ignore[arg-type]
        contexts[-1].set_default_timeout(PATIENCE_MS)
        page = contexts[-1].new_page()
        page.goto(url)
        return page

    yield opened
    for context in contexts:
        context.close()


def begun(service: ServiceProcess, key: str = "") -> None:
    headers = {"Authorization": f"Bearer {key}"} if key else {}
    started = service.http.post("/api/campaigns", json={"recipe": RECIPE.format(rate=FIRST_DPS)}, headers=headers)
    assert started.status_code == 201, started.text


def kill(service: ServiceProcess) -> None:
    """Kill supervisor and web process at once; returns when the bench process answers at the address."""
    service.process.send_signal(signal.SIGSTOP)  # it starts no other web process meanwhile
    os.kill(service.web_pid, signal.SIGKILL)
    service.process.kill()
    service.process.wait()
    while True:
        try:
            httpx.get(service.url, timeout=WAIT_S)
            return
        except httpx.TransportError:
            before_next_request()


def test_with_its_service_dead_the_stop_of_an_open_page_reaches_the_bench_process(
    tmp_path: Path, context_of: Callable[..., Page]
) -> None:
    from playwright.sync_api import expect

    with running(tmp_path / "lab.sqlite") as service:
        begun(service)
        page = context_of(f"{service.url}/bench")
        page.get_by_role("button", name="Safe stop").wait_for()
        kill(service)
        press_stop(page)
        expect(page.locator(".toasts")).to_contain_text("Stopped. The table stands. The service does not answer")
        page.reload()
        expect(page.locator("h1")).to_have_text("Stopped. The table stands.")
        expect(page.locator("body")).to_contain_text("No campaign runs on bench single-axis-sim")


def test_the_bench_process_s_own_page_stops_by_an_operator_s_key_without_javascript(
    tmp_path: Path, context_of: Callable[..., Page]
) -> None:
    from playwright.sync_api import expect

    database, keys = tmp_path / "lab.sqlite", {}
    for role in ("viewer", "operator"):
        made = run_labctl(["key", "create", role, "--role", role, "--json", "--database", str(database)])
        keys[role] = json.loads(made.stdout)["key"]
    with running(database, "--require-keys") as service:
        begun(service, keys["operator"])
        kill(service)
        page = context_of(f"{service.url}/campaigns/1", java_script_enabled=False)
        expect(page.locator("h1")).to_have_text("labctl does not answer")
        expect(page.locator("body")).to_contain_text("Campaign 1 runs on bench single-axis-sim")
        for role, title in (("viewer", TITLE), ("operator", "Stopped. The table stands.")):
            page.get_by_label("Key of an operator").fill(keys[role])
            page.get_by_role("button", name="Stop").click()
            expect(page.locator("h1")).to_have_text(title)

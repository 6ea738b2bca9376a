"""How fresh a page is: stale within 5 s of the last answer of its service, and paused while its tab is hidden."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from labctl.store import holder_of
from tests.helpers.browser import Faults, settled
from tests.helpers.processes import ServiceProcess, running

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Locator, Page

#: Promised: from the moment when the service falls silent.
STALE_MS = 5000
#: A process that was ended is replaced within this, on a busy machine too.
REPLACED_MS = 60_000
FREE = "is on the bench and free"
HEARTBEAT = "/health/heartbeat"


@contextmanager
def bench_page(chromium: Browser, service: ServiceProcess) -> Iterator[Page]:
    """Open the bench page of a service in a process of its own; nothing runs there."""
    from playwright.sync_api import expect

    page = chromium.new_page()
    try:
        page.goto(f"{service.url}/bench")
        settled(page)
        expect(page.get_by_text(FREE)).to_be_visible()
        yield page
    finally:
        page.close()


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ServiceProcess]:
    """A service that no test disturbs."""
    with running(tmp_path_factory.mktemp("served") / "lab.sqlite") as process:
        yield process


@pytest.fixture
def idle(served: ServiceProcess, chromium: Browser) -> Iterator[Page]:
    with bench_page(chromium, served) as page:
        yield page


def colour(page: Page) -> str:
    """Return the colour in which the page says that all is well."""
    found: str = page.evaluate("() => getComputedStyle(document.documentElement).getPropertyValue('--good').trim()")
    return found


def expect_stale(page: Page) -> None:
    from playwright.sync_api import expect

    expect(page.locator("[data-freshness]")).to_contain_text("Stale.", timeout=STALE_MS)
    expect(page.get_by_text(FREE)).not_to_be_visible(timeout=1)
    expect(page.get_by_text("No campaign is running")).not_to_be_visible(timeout=1)
    expect(page.get_by_text("Not known now").first).to_be_visible(timeout=1)
    text: str = page.evaluate("() => getComputedStyle(document.documentElement).getPropertyValue('--text').trim()")
    assert colour(page) == text


@pytest.mark.slow
def test_a_service_that_stands_still_or_is_killed_is_stale_within_5_s(tmp_path: Path, chromium: Browser) -> None:
    from playwright.sync_api import expect

    with running(tmp_path / "lab.sqlite") as served, bench_page(chromium, served) as idle:
        line, calm = idle.locator("[data-freshness]"), colour(idle)
        expect(line).to_contain_text("Last answer of the service 0 s ago")
        os.kill(served.web_pid, signal.SIGSTOP)
        expect_stale(idle)
        os.kill(served.web_pid, signal.SIGCONT)
        expect_fresh(idle, line, calm)
        os.kill(served.bench_pid, signal.SIGSTOP)  # the supervisor ends it, and starts another
        expect_stale(idle)
        expect_fresh(idle, line, calm)
        settled(idle)  # a page that is drawn again at this moment has no values that could be stale
        holder = holder_of(str(served.database))
        assert holder is not None
        for pid in (served.process.pid, holder.pid):  # the web process ends with the supervisor
            os.kill(pid, signal.SIGKILL)
        expect_stale(idle)


def expect_fresh(page: Page, line: Locator, calm: str) -> None:
    from playwright.sync_api import expect

    expect(line).to_contain_text("Last answer of the service 0 s ago", timeout=REPLACED_MS)
    expect(line).not_to_contain_text("Stale.", timeout=REPLACED_MS)
    expect(page.get_by_text(FREE)).to_be_visible(timeout=REPLACED_MS)
    assert colour(page) == calm


@pytest.mark.slow
def test_a_network_that_is_gone_is_stale_within_5_s(idle: Page) -> None:
    from playwright.sync_api import expect

    idle.context.set_offline(True)
    expect_stale(idle)
    idle.context.set_offline(False)
    expect(idle.get_by_text(FREE)).to_be_visible()


def test_a_bench_process_that_is_not_heard_is_stale_though_the_service_answers(idle: Page) -> None:
    idle.route(f"**{HEARTBEAT}", lambda asked: asked.fulfill(json={"status": "ok", "heard_s": 12.0}))
    expect_stale(idle)
    assert "Last answer of the bench 12 s ago" in idle.locator("[data-freshness]").inner_text()


@pytest.mark.slow
def test_a_service_that_answers_but_refuses_what_the_page_shows_is_stale(idle: Page) -> None:
    from playwright.sync_api import expect

    refusal = {"title": "The database cannot be used", "detail": "the database is locked", "status": 503}
    idle.route("**/api/benches", lambda asked: asked.fulfill(status=503, json=refusal))
    expect(idle.locator("[data-freshness]")).to_contain_text("the database is locked")
    expect_stale(idle)
    idle.unroute("**/api/benches")
    expect(idle.get_by_text(FREE)).to_be_visible()


def test_a_page_asks_once_a_second_and_not_while_its_tab_is_hidden(visit: Callable[..., Page], faults: Faults) -> None:
    from playwright.sync_api import expect

    page = visit("/units", alone=True)
    page.clock.install()
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url) if request.url.endswith(HEARTBEAT) else None)
    page.reload()
    settled(page)
    line = page.locator("[data-freshness]")
    expect(line).to_contain_text("Last answer of the service")
    before = len(asked)
    page.clock.run_for(10_000)
    expect(line).to_contain_text("ast answer of the service")
    assert len(asked) - before <= 11

    page.evaluate(HIDE, True)
    expect(line).to_contain_text("Paused while this tab is hidden")
    before = len(asked)
    page.clock.run_for(60_000)
    assert len(asked) == before
    page.evaluate(HIDE, False)
    expect(line).to_contain_text("Last answer of the service 0 s ago")
    assert len(asked) == before + 1
    faults.clear()


#: What a browser does when a tab is hidden or shown.
HIDE = """hidden => {
  Object.defineProperty(document, "hidden", { configurable: true, get: () => hidden });
  document.dispatchEvent(new Event("visibilitychange"));
}"""

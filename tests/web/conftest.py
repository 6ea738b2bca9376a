"""A service in this process and a real browser before it."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from labctl.services.campaigns import preparation
from tests.helpers.browser import PATIENCE_MS, WIDE, Faults, Service
from tests.helpers.paced_hand import PacedClock, PacedPerson

if TYPE_CHECKING:
    from playwright.sync_api import Browser, BrowserContext, Page

CHROMIUM = shutil.which("chromium-headless-shell") or shutil.which("chromium")
ARGUMENTS = (
    "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--enable-unsafe-swiftshader",
)  # fmt: skip


@pytest.fixture(autouse=True)
def answers(shared_answers: Path) -> Path:
    """All pages share their kept answers."""
    return shared_answers


@pytest.fixture
def service(tmp_path: Path) -> Iterator[Service]:
    serving = Service(tmp_path)
    serving.start()
    yield serving
    serving.stop()


@pytest.fixture
def waiting(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Service]:
    """A bench whose campaign waits for a person, until it is stopped."""
    monkeypatch.setattr(preparation, "operator_of", lambda _: PacedPerson())
    serving = Service(tmp_path, clock=PacedClock)
    serving.start()
    yield serving
    serving.stop()


@pytest.fixture(scope="session")
def chromium() -> Iterator[Browser]:
    if CHROMIUM is None:
        pytest.skip("no chromium (on Debian: apt-get install chromium)")
    from playwright.sync_api import expect, sync_playwright

    expect.set_options(timeout=PATIENCE_MS)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=list(ARGUMENTS))
        yield browser
        browser.close()


@pytest.fixture
def faults() -> Iterator[Faults]:
    found = Faults()
    yield found
    assert not found, "\n".join(found)


@pytest.fixture
def visit(chromium: Browser, service: Service, faults: Faults) -> Iterator[Callable[..., Page]]:
    """Open a page of the service in a browser of its own: `visit("/bench", size=NARROW, dark=True)`.

    Unless `idle`, the browser is never idle: a page without figures does not load Plotly for the next one (1 s).
    """
    contexts: list[BrowserContext] = []

    def opened(path: str, *, size: dict[str, int] = WIDE, dark: bool = False, idle: bool = False) -> Page:
        context = chromium.new_context(
            viewport=size,
            color_scheme="dark" if dark else "light",
            accept_downloads=True,
        )
        contexts.append(context)
        context.set_default_timeout(PATIENCE_MS)
        if not idle:
            context.add_init_script("window.requestIdleCallback = () => 0")
        page = context.new_page()
        page.on("pageerror", lambda error: faults.append(f"{path}: {error}"))
        page.on("console", lambda reported: faults.hear(path, reported))
        page.on("request", lambda asked: faults.check_request(asked.url, service.url))
        page.goto(service.url + path)
        return page

    yield opened
    for context in contexts:
        context.close()

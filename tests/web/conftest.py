"""A service in this process and a real browser before it."""

from __future__ import annotations

import shutil
import socket
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import httpx
import pytest
import uvicorn

from instruments.clock import SystemClock, VirtualClock
from labctl.api import create_app
from labctl.api.access_policy import AccessPolicy
from labctl.services.app import LabService
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.planning.loading import load_bench
from labctl.store import Store
from labctl.store.connection.database import Database

if TYPE_CHECKING:
    from playwright.sync_api import Browser, BrowserContext, ConsoleMessage, Page

CHROMIUM = shutil.which("chromium")
ARGUMENTS = (
    "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--enable-unsafe-swiftshader",
)  # fmt: skip
WIDE, NARROW = {"width": 1280, "height": 860}, {"width": 390, "height": 844}
#: How long a page may take before a test gives up: a busy machine is slow, not wrong.
PATIENCE_MS = 45_000


@dataclass
class Service:
    """labctl as it is served, on a port of its own; it can be stopped and started again."""

    folder: Path
    bench: str | None = "single-axis-sim"
    keys: bool = False
    port: int = 0
    url: str = ""
    lab_service: LabService = field(init=False)

    def start(self) -> None:
        """Begin to answer."""
        store = Store(Database(str(self.folder / "lab.sqlite"), write=True))
        runner = BenchRunner(store, load_bench(self.bench), VirtualClock) if self.bench else None
        self.lab_service = LabService(store, SystemClock(), runner)
        listener = socket.socket()
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind(("127.0.0.1", self.port))
        self.port = listener.getsockname()[1]
        self.url = f"http://127.0.0.1:{self.port}"
        app = create_app(self.lab_service, AccessPolicy(keys=self.keys))
        self._server = uvicorn.Server(
            uvicorn.Config(app, log_level="error", lifespan="on", timeout_graceful_shutdown=1)
        )
        self._thread = threading.Thread(target=self._server.run, kwargs={"sockets": [listener]})
        self._thread.start()
        while not self._server.started and self._thread.is_alive():
            self._thread.join(0.01)

    def stop(self) -> None:
        """Answer no more; the bench is left safe."""
        self._server.should_exit = True
        self._thread.join(60)
        assert not self._thread.is_alive()

    def post(self, path: str, body: object) -> object:
        """Ask past the pages, to prepare what a test needs."""
        answer = httpx.post(self.url + path, json=body, timeout=120)
        answer.raise_for_status()
        return answer.json()

    def get(self, path: str) -> object:
        """Look past the pages."""
        answer = httpx.get(self.url + path, timeout=120)
        answer.raise_for_status()
        return answer.json()

    def until(self, path: str, holds: Callable[[object], bool]) -> object:
        """Return the answer once it is as it should be; gives up when the test's own time is over."""
        end = time.monotonic() + PATIENCE_MS / 1000
        while not holds(answer := self.get(path)):
            assert time.monotonic() < end, answer
            threading.Event().wait(0.05)
        return answer


@pytest.fixture(scope="session")
def _kept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("kept")


@pytest.fixture(autouse=True)
def cache(_kept: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """All pages share their kept answers: the same criticism is worked out once, as it is for a person."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(_kept))
    return _kept


@pytest.fixture
def service(tmp_path: Path) -> Iterator[Service]:
    serving = Service(tmp_path)
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


class Faults(list[str]):
    """What a page complained of; a test that expects a complaint clears it."""

    def hear(self, path: str, told: ConsoleMessage) -> None:
        """Take in what the browser writes to its console."""
        where = str(told.location.get("url", ""))
        if told.type == "error" and not where.endswith(
            "/allan"
        ):  # few recordings have a static record; the page says so
            self.append(f"{path}: {told.text} {where}")


@pytest.fixture
def faults() -> Iterator[Faults]:
    found = Faults()
    yield found
    assert not found, "\n".join(found)


@pytest.fixture
def visit(chromium: Browser, service: Service, faults: Faults) -> Iterator[Callable[..., Page]]:
    """Open a page of the service in a browser of its own: `visit("/bench", size=NARROW, dark=True)`."""
    contexts: list[BrowserContext] = []

    def opened(path: str, *, size: dict[str, int] = WIDE, dark: bool = False) -> Page:
        context = chromium.new_context(
            viewport=size,
            color_scheme="dark" if dark else "light",
            accept_downloads=True,  # type: ignore[arg-type]
        )
        contexts.append(context)
        context.set_default_timeout(PATIENCE_MS)
        page = context.new_page()
        page.on("pageerror", lambda error: faults.append(f"{path}: {error}"))
        page.on("console", lambda told: faults.hear(path, told))
        page.on("request", lambda asked: _only_here(asked.url, service.url, faults))
        page.goto(service.url + path)
        return page

    yield opened
    for context in contexts:
        context.close()


def _only_here(url: str, home: str, faults: Faults) -> None:
    if not url.startswith((home, "data:", "blob:")):
        faults.append(f"a page asked for something outside: {url}")

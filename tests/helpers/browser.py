"""What the tests of the pages share: a service on a port, the sizes of a screen, what a page complains of."""

from __future__ import annotations

import errno
import json
import re
import socket
import ssl
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import httpx
import uvicorn

from instruments.clock import Clock, SystemClock, VirtualClock
from labctl.api import create_app
from labctl.api.access_policy import AccessPolicy, ReadOnlyAccess
from labctl.processes.web_process import WORKER_MODULES
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.computation import InWorkers, Limits
from labctl.services.lab_service import LabService
from labctl.services.planning.loading import load_bench
from labctl.store import Store
from labctl.store.connection.database import Database
from tests.helpers.patience import WAIT_S
from tests.helpers.waiting import wait_until

if TYPE_CHECKING:
    from playwright.sync_api import BrowserContext, ConsoleMessage, Page

WIDE, NARROW = {"width": 1280, "height": 860}, {"width": 390, "height": 844}
#: How long a page may take before a test gives up: a busy machine is slow, not wrong.
PATIENCE_MS = round(1000 * WAIT_S)
LOOPBACK = "127.0.0.1"
#: For plain HTTP: otherwise each client reads the certificates of all authorities, 25 ms.
NO_CERTIFICATES = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
#: For requests that run when the service stops, whole seconds.
GRACE_S = 20

#: The sign of a negative number on a page.
MINUS = "\u2212"
#: How often a page is asked whether it is so far, milliseconds; by default at each frame, which it then has to draw.
POLL_MS = 50
#: The figure of a name, once Plotly has drawn it.
PLOT = """[...document.querySelectorAll(".plot")].find((each) => each.getAttribute("aria-label").startsWith(name))"""
DRAWN = f"name => Boolean({PLOT}?.data)"
#: The traces and the layout of a figure as Plotly has them, with typed arrays as lists.
READ = f"""name => {{
  const plot = {PLOT};
  const plain = (key, value) => (ArrayBuffer.isView(value) ? [...value] : value);
  return JSON.stringify({{data: plot.data, layout: plot.layout}}, plain);
}}"""


@cache
def usual_port() -> socket.socket:
    """Take a port for the services of this process: a browser keeps compiled scripts by their whole address.

    A socket that is bound and does not listen keeps the port: no other program is given it, and a service may open it.
    """
    kept = socket.socket()
    kept.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    kept.bind((LOOPBACK, 0))
    return kept


def listening(port: int) -> socket.socket:
    """Return a socket that listens to a port; to the usual one for 0, or to any other while that one is in use."""
    for number in (port,) if port else (usual_port().getsockname()[1], 0):
        listener = socket.socket()
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind((LOOPBACK, number))
            listener.listen()
        except OSError as error:
            listener.close()
            if port or error.errno != errno.EADDRINUSE:
                raise
        else:
            return listener
    raise AssertionError("no port is free")


class Server(uvicorn.Server):
    """An HTTP server that says when it answers."""

    def __init__(self, config: uvicorn.Config) -> None:
        super().__init__(config)
        self.ready = threading.Event()

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Open the ports."""
        await super().startup(sockets)
        self.ready.set()

    def serve_until_stopped(self, listener: socket.socket) -> None:
        """Serve in this thread; `ready` is also set when it failed."""
        try:
            self.run(sockets=[listener])
        finally:
            self.ready.set()
            listener.close()


@dataclass
class Service:
    """labctl as it is served, on a port of its own; it can be stopped and started again."""

    folder: Path
    bench: str | None = "single-axis-sim"
    keys: bool = False
    port: int = 0
    url: str = ""
    clock: Callable[[], Clock] = VirtualClock  #: of the bench
    limits: Limits | None = None  #: of worker processes; without, it computes in threads
    acts_at: str | None = None  #: it only reads, and another service acts
    lab_service: LabService = field(init=False)

    def start(self) -> None:
        """Begin to answer."""
        reads = self.acts_at is not None
        store = Store(Database(str(self.folder / "lab.sqlite"), write=not reads, read_only=reads))
        runner = BenchRunner(store, load_bench(self.bench), self.clock) if self.bench and not reads else None
        computation = InWorkers(store, self.limits, preload=WORKER_MODULES) if self.limits else None
        self.lab_service = LabService(store, SystemClock(), runner, computation, acts_at=self.acts_at)
        listener = listening(self.port)
        self.port = listener.getsockname()[1]
        self.url = f"http://{LOOPBACK}:{self.port}"
        access = AccessPolicy(keys=self.keys, read_only=ReadOnlyAccess(self.acts_at) if reads else None)
        app = create_app(self.lab_service, access)
        self._server = Server(uvicorn.Config(app, log_level="error", lifespan="on", timeout_graceful_shutdown=GRACE_S))
        self._thread = threading.Thread(target=self._server.serve_until_stopped, args=(listener,), name="test service")
        self._thread.start()
        self._http = httpx.Client(base_url=self.url, timeout=WAIT_S, verify=NO_CERTIFICATES)
        assert self._server.ready.wait(WAIT_S)
        assert self._server.started

    def stop(self) -> None:
        """Answer no more; the bench is left safe. As a signal does: what follows a campaign is ended first."""
        self._http.close()  # else the server waits for this connection
        self.lab_service.end_soon()
        self._server.should_exit = True
        self._thread.join(WAIT_S)
        assert not self._thread.is_alive()

    def post(self, path: str, body: object) -> Any:
        """Send a request beside the pages, to prepare what a test needs."""
        answer = self._http.post(path, json=body)
        answer.raise_for_status()
        return answer.json()

    def get(self, path: str) -> Any:
        """Read an answer beside the pages."""
        answer = self._http.get(path)
        answer.raise_for_status()
        return answer.json()

    def until(self, path: str, holds: Callable[[Any], bool]) -> Any:
        """Return the answer once it is as it should be; polled whenever the bench reports something."""
        return wait_until(self.lab_service.bench_access.listen, lambda: self.get(path), holds)


class Profile:
    """The profile of a browser: tests follow each other in it, and take over nothing but files and compiled scripts."""

    #: What a page of an earlier test could leave behind.
    LEFT = "cookies,local_storage,indexeddb,cache_storage,service_workers,file_systems,websql"

    def __init__(self, context: BrowserContext) -> None:
        self._context = context
        self._kept = context.pages[0]  # a browser without a page may end
        self._session = context.new_cdp_session(self._kept)

    def new_page(self) -> Page:
        """Open a page."""
        return self._context.new_page()

    def clear(self, origin: str) -> None:
        """Close all pages, and forget what those of a service kept."""
        for page in self._context.pages:
            if page is not self._kept:
                page.close()
        self._session.send("Storage.clearDataForOrigin", {"origin": origin, "storageTypes": self.LEFT})
        self._context.clear_cookies()


class Faults(list[str]):
    """What a page complained of; a test that expects a complaint clears it."""

    def hear(self, path: str, reported: ConsoleMessage) -> None:
        """Take in what the browser writes to its console."""
        where = str(reported.location.get("url", ""))
        # few recordings have a static record; the page says so
        known = where.endswith("/allan")
        # a busy service had carried out a stop when the page asked again; the page then asks how the campaign has ended
        known = known or (where.endswith("/abort") and "409" in reported.text)
        if reported.type == "error" and not known:
            self.append(f"{path}: {reported.text} {where}")

    def check_request(self, url: str, service_url: str) -> None:
        """Note a request to any other server than the service."""
        if not url.startswith((service_url, "data:", "blob:")):
            self.append(f"a page asked for something outside: {url}")


def settled(page: Page) -> None:
    """Wait until the page has what it asked for."""
    page.wait_for_selector("main h1")
    page.wait_for_function("() => !document.querySelector('main[aria-busy], .busy')", polling=POLL_MS)


SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def on_page(text: str) -> str:
    """Return a text of the service as a page writes it: with the minus sign, °C, and powers raised."""

    def power(found: re.Match[str]) -> str:
        return f"{found[1]} × 10{str(int(found[2])).translate(SUPERSCRIPTS)}"

    text = re.sub(r"(?<![\w.-])(-?\d+(?:\.\d+)?)e([+-]?\d+)(?![\w.]*\w)", power, text)
    text = re.sub(r"\^(-?\d+)", lambda found: found[1].translate(SUPERSCRIPTS), text)
    return re.sub(r"(?<![\w-])-(?=\d|[xyz]\b)", MINUS, text.replace("deg C", "°C"))


def number_of(text: str) -> float:
    """Return a number that a page shows: its sign is the minus sign."""
    assert "-" not in text, f"{text!r} has a hyphen where a page has the minus sign"
    return float(text.replace(MINUS, "-"))


def figure(page: Page, name: str) -> dict[str, Any]:
    """Return what a figure of the page shows, once it is drawn."""
    plot = page.locator(f'.plot[aria-label^="{name}"]').first
    plot.scroll_into_view_if_needed()
    page.wait_for_function(DRAWN, arg=name, polling=POLL_MS)
    found: dict[str, Any] = json.loads(page.evaluate(READ, name))
    return found

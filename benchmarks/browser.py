"""Debian's chromium as a person has it: while a page loads no debugger listens, which makes large scripts slower."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import httpx
from playwright.sync_api import sync_playwright

from benchmarks.machine import processor_s

if TYPE_CHECKING:
    from playwright.sync_api import Page

ARGUMENTS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking",
    "--remote-debugging-port=0", "--window-size=1280,860",
)  # fmt: skip
PATIENCE_S = 30.0
#: A browser has started when it takes less than this share of a core for so long, s.
STILL_SHARE, STILL_S = 0.1, 0.5


@dataclass(frozen=True)
class Chromium:
    """A running browser."""

    control: str  #: address of its DevTools interface
    process: int


@contextmanager
def chromium() -> Iterator[Chromium]:
    """Start a browser with an empty profile, and wait until it has started."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        words = [shutil.which("chromium") or "chromium", *ARGUMENTS, f"--user-data-dir={folder}", "about:blank"]
        with subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as browser:
            try:
                reported = Path(folder) / "DevToolsActivePort"
                _until(lambda: reported.exists() and bool(reported.read_text().strip()))
                _until(lambda: _stands_still(browser.pid))
                yield Chromium(f"http://127.0.0.1:{reported.read_text().split()[0]}", browser.pid)
            finally:
                browser.terminate()


def _stands_still(process: int) -> bool:
    """Wait a moment; return whether a browser did next to nothing in it: one that still starts takes all cores."""
    before_s = processor_s(process)
    time.sleep(STILL_S)
    return processor_s(process) - before_s <= STILL_SHARE * STILL_S


def version(browser: Chromium) -> str:
    """Return which browser it is."""
    return str(httpx.get(f"{browser.control}/json/version").json()["Browser"])


@contextmanager
def opened(browser: Chromium, url: str, settled_s: float = 4.0) -> Iterator[Page]:
    """Open an address in a tab of its own and leave it alone for a time; only then read it."""
    httpx.put(f"{browser.control}/json/new?{url}").raise_for_status()
    time.sleep(settled_s)
    with sync_playwright() as playwright:
        contexts = playwright.chromium.connect_over_cdp(browser.control).contexts
        page = next(page for page in contexts[0].pages if page.url.startswith(url))
        yield page
        page.close()


#: Bytes as they travelled, headers included; 0 for what came out of the cache.
MOVED = """() => ["navigation", "resource"].flatMap((kind) => performance.getEntriesByType(kind))
  .reduce((sum, entry) => sum + entry.transferSize, 0)"""


def moved_kb(page: Page) -> float:
    """Return what the current view of a page has moved over the network, kB."""
    moved: float = page.evaluate(MOVED)
    return moved / 1000


def marked_s(page: Page, mark: str) -> float:
    """Return when a page first marked something in its time line, s since it was asked for."""
    times: list[float] = page.evaluate("mark => performance.getEntriesByName(mark).map(entry => entry.startTime)", mark)
    return min(times) / 1e3


def _until(holds: Callable[[], bool]) -> None:
    end = time.monotonic() + PATIENCE_S
    while not holds():
        if time.monotonic() > end:
            raise TimeoutError("chromium does not start")
        time.sleep(0.05)

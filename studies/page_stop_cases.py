"""Safe stop on a page in the cases that a random kill seldom meets: no process answers, frozen processes, several tabs.

Each case runs `labctl serve` on simulated instruments of another process, with a page of it in a browser, and says what
the table heard and what the page showed. `LABCTL_STUDY_CASES` names the cases to run; `LABCTL_STUDY_PICTURES` a folder
for pictures of what a person sees.
"""

from __future__ import annotations

import contextlib
import os
import signal
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from studies.page_stops import PICTURES, Watch, _ended, begin, kill, noticed, successor, waited
from studies.stop_browser import chromium, opened, picture, press_stop, shown_over
from studies.stop_rig import Table, simulators
from studies.stops import Service

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page


@dataclass
class Case:
    """A service with a campaign whose table turns, and a page of it."""

    browser: Browser
    bench: Path
    table: Table
    service: Service
    watch: Watch
    campaign: int
    simulator: int  #: process of the instruments

    def page(self, path: str = "/bench", size: str = "wide", *, dark: bool = False) -> Page:
        """Open a page in a browser of its own."""
        page = opened(self.browser, self.service.url + path, size, dark=dark)
        page.get_by_role("button", name="Safe stop").wait_for()
        return page

    def told(self, since_s: float, within_s: float = 20.0) -> float | None:
        """Return after how long the table heard the stop, s."""
        waited(lambda: self.watch.stopped_s(since_s), within_s)
        at_s = self.watch.stopped_s(since_s)
        return None if at_s is None else round(at_s - since_s, 2)


def is_said(page: Page) -> bool:
    """Return whether NOT STOPPED lies plainly over a page now."""
    shown = shown_over(page)
    return bool(shown) and shown[-1].plain


def says_stands(page: Page) -> bool:
    """Return whether a page says that the table stands, and nothing lies over it."""
    return "Stopped." in page.inner_text(".toasts") and not is_said(page)


def no_process_answers(case: Case) -> list[tuple[str, bool]]:
    """All three processes are killed; later another service starts."""
    pages = [case.page(size=size, dark=dark) for size, dark in (("wide", False), ("narrow", True))]
    kill(case.service, "supervisor", "web", "bench")
    pressed_s = min([press_stop(page) for page in pages])
    said = [waited(lambda page=page: is_said(page), 5.0) for page in pages]
    time.sleep(6.0)
    for page, name in zip(pages, ("wide", "narrow"), strict=True):
        picture(page, PICTURES, f"silent-{name}")
    stays = [is_said(page) for page in pages]
    with successor(case.service, case.bench):
        told_s = case.told(pressed_s, 40.0)
        over = [waited(lambda page=page: says_stands(page), 20.0) for page in pages]
        picture(pages[0], PICTURES, "silent-then-successor")
        stopped_s = case.watch.stopped_s(pressed_s) or 0.0
        gone = [[each.at_s for each in shown_over(page) if not each.shown and each.at_s > pressed_s] for page in pages]
        time.sleep(3.0)
        again = case.watch.turned_again(stopped_s)
    return [
        ("NOT STOPPED within 5 s on both pages", all(said)), ("stays while no process answers", all(stays)),
        (f"the successor stops the table (after {told_s} s)", told_s is not None),
        ("goes on both pages", all(over)),
        ("only after the stop", all(at >= stopped_s - 0.05 for each in gone for at in each)),
        ("nothing starts again", not again),
    ]  # fmt: skip


def web_frozen(case: Case) -> list[tuple[str, bool]]:
    """The web process stands still."""
    page = case.page()
    os.kill(case.service.pids["web"], signal.SIGSTOP)
    pressed_s = press_stop(page)
    told_s = case.told(pressed_s)
    over = waited(lambda: says_stands(page), 20.0)
    said = [round(each.at_s - pressed_s, 2) for each in shown_over(page) if each.plain]
    return [
        (f"table told after {told_s} s, NOT STOPPED shown after {said} s", told_s is not None),
        ("told within 2 s or said within 5 s", (told_s or 99) <= 2 or (bool(said) and said[0] <= 5)),
        ("then says that it stands", over),
    ]


def web_frozen_for_a_moment(case: Case) -> list[tuple[str, bool]]:
    """The web process stands still for 4 s while a page is loaded: the page is complete afterwards."""
    os.kill(case.service.pids["web"], signal.SIGSTOP)
    page = opened(case.browser, "about:blank")
    page.evaluate(f"setTimeout(() => {{ location.href = '{case.service.url}/bench' }}, 10)")
    time.sleep(4.0)
    os.kill(case.service.pids["web"], signal.SIGCONT)
    with contextlib.suppress(Exception):
        page.get_by_role("button", name="Safe stop").wait_for(timeout=30_000)
    picture(page, PICTURES, "web-frozen-for-a-moment")
    return [("the page is complete", page.get_by_role("button", name="Safe stop").count() == 1)]


def seven_tabs(case: Case) -> list[tuple[str, bool]]:
    """Seven tabs of one browser show the bench, more than the connections that a browser has for one service."""
    first = case.page()
    for _ in range(6):
        first.context.new_page().goto(case.service.url + "/bench", wait_until="commit")
    time.sleep(3.0)
    pressed_s = press_stop(first)
    told_s = case.told(pressed_s)
    return [
        (f"table told after {told_s} s", (told_s or 99) <= 2),
        ("then says that it stands", waited(lambda: says_stands(first), 10.0)),
    ]


def two_tabs(case: Case) -> list[tuple[str, bool]]:
    """Two tabs, the service killed: both press."""
    pages = [case.page(), case.page("/campaigns/1", "narrow")]
    kill(case.service, "supervisor", "web")
    pressed_s = press_stop(pages[0])
    press_stop(pages[1])
    told_s = case.told(pressed_s)
    over = [waited(lambda page=page: says_stands(page), 10.0) for page in pages]
    return [(f"table told after {told_s} s", (told_s or 99) <= 2), ("both say that it stands", all(over))]


def own_page_then_successor(case: Case) -> list[tuple[str, bool]]:
    """The bench process's page is loaded and pressed, without JavaScript; then another service takes over."""
    kill(case.service, "supervisor", "web")
    noticed(case.service.url, time.time())
    pages = []
    for size, dark in (("wide", False), ("narrow", True)):
        context = case.browser.new_context(
            viewport={"width": 1280, "height": 860} if size == "wide" else {"width": 390, "height": 844},
            color_scheme="dark" if dark else "light", java_script_enabled=size != "wide",
        )  # fmt: skip
        pages.append(context.new_page())
        pages[-1].goto(f"{case.service.url}/campaigns/1")
        picture(pages[-1], PICTURES, f"own-running-{size}")
    pressed_s = time.time()
    pages[0].get_by_role("button", name="Stop").click()
    told_s = case.told(pressed_s)
    first = "Stopped. The table stands." in pages[0].inner_text("body")
    picture(pages[0], PICTURES, "own-stopped-wide")
    time.sleep(4.0)
    later = ["Stopped. The table stands." in page.inner_text("body") for page in pages]
    picture(pages[1], PICTURES, "own-stopped-narrow")
    with successor(case.service, case.bench):
        pages[1].get_by_role("heading", name="Bench", exact=True).wait_for(timeout=30_000)
        picture(pages[1], PICTURES, "own-then-successor")
        time.sleep(3.0)
        again = case.watch.turned_again(pressed_s + (told_s or 0.0))
    return [
        (f"table told after {told_s} s", (told_s or 99) <= 2), ("says that it stands", first),
        ("and after it has asked again, on both", all(later)), ("nothing starts again", not again),
    ]  # fmt: skip


def table_silent(case: Case) -> list[tuple[str, bool]]:
    """The instruments do not answer any more; then they do."""
    page = case.page()
    os.kill(case.simulator, signal.SIGSTOP)
    pressed_s = press_stop(page)
    said = waited(lambda: is_said(page), 6.0)
    time.sleep(25.0)
    picture(page, PICTURES, "table-silent")
    stays = is_said(page)
    os.kill(case.simulator, signal.SIGCONT)
    told_s = case.told(pressed_s, 60.0)
    over = waited(lambda: not is_said(page), 60.0)
    picture(page, PICTURES, "table-silent-then-answers")
    return [("NOT STOPPED is said", said), ("and stays", stays), (f"table told after {told_s} s", told_s is not None),
            ("then it goes", over)]  # fmt: skip


def table_silent_without_service(case: Case) -> list[tuple[str, bool]]:
    """The same on the bench process's own page."""
    kill(case.service, "supervisor", "web")
    noticed(case.service.url, time.time())
    page = case.browser.new_context(viewport={"width": 1280, "height": 860}).new_page()
    page.goto(case.service.url)
    os.kill(case.simulator, signal.SIGSTOP)
    page.get_by_role("button", name="Stop").click()
    said = "NOT STOPPED. Use the stop switch." in page.inner_text("body")
    picture(page, PICTURES, "own-not-stopped")
    time.sleep(25.0)
    stays = "NOT STOPPED. Use the stop switch." in page.inner_text("body")
    picture(page, PICTURES, "own-not-stopped-later")
    os.kill(case.simulator, signal.SIGCONT)
    return [("NOT STOPPED is said", said), ("and stays", stays)]


CASES: dict[str, Callable[[Case], list[tuple[str, bool]]]] = {
    each.__name__: each
    for each in (
        no_process_answers, web_frozen, web_frozen_for_a_moment, seven_tabs, two_tabs, own_page_then_successor,
        table_silent, table_silent_without_service,
    )
}  # fmt: skip


def simulator_of(bench: Path) -> int:
    """Return the process that simulates the instruments of a bench file."""
    for entry in Path("/proc").iterdir():
        with contextlib.suppress(OSError, ValueError):
            words = (entry / "cmdline").read_bytes().split(b"\0")
            if b"simulator" in words and str(bench).encode() in words:
                return int(entry.name)
    raise ProcessLookupError(bench)


def run() -> dict[str, float]:
    """Run the cases, a line for each thing that is promised."""
    names = os.environ.get("LABCTL_STUDY_CASES", " ".join(CASES)).split()
    held = total = 0
    with chromium() as browser:
        for name in names:
            with tempfile.TemporaryDirectory() as folder, simulators(Path(folder)) as (bench, table):
                service, watch = Service(Path(folder), bench), Watch(table)
                try:
                    case = Case(browser, bench, table, service, watch, begin(service, table), simulator_of(bench))
                    for text, holds in CASES[name](case):
                        held, total = held + holds, total + 1
                        print(f"   {name}: {'' if holds else 'NOT AS PROMISED: '}{text}", flush=True)
                finally:
                    for context in browser.contexts:
                        context.close()
                    _ended(service)
    return {"promises": float(total), "kept": float(held)}

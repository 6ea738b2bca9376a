"""Safe stop on a page whose service is killed at a random moment: what the table hears, and what the page says.

Each round runs `labctl serve` on simulated instruments of another process and opens a page of it in a browser.
Supervisor and web process are killed at a random moment around the press of "Safe stop", in half of the rounds within
0.2 s of it. In every fifth round the page is loaded again instead, and the bench process's own page at the address
stops the table. In every third round another service is started afterwards. `LABCTL_STUDY_PAGE_STOPS` is how many
rounds; `LABCTL_STUDY_PICTURES` a folder for pictures.
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import httpx
import numpy as np

from labctl.answers.campaigns import BENCH_CHECKS
from studies.stop_browser import Shown, chromium, opened, picture, press_stop, shown_over
from studies.stop_rig import RECIPE, Heard, Table, simulators
from studies.stops import SAID_S, TOLD_S, Service

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

ROUNDS = int(os.environ.get("LABCTL_STUDY_PAGE_STOPS", "50"))
#: The numbers of the rounds to run, where not all of them.
ONLY = {int(each) for each in os.environ.get("LABCTL_STUDY_ONLY", "").split()}
PICTURES = Path(os.environ["LABCTL_STUDY_PICTURES"]) if "LABCTL_STUDY_PICTURES" in os.environ else None
NOTICED_S = 2.0
#: The message goes, and the page says that the table stands, within this, s.
GONE_S = 8.0
PAGES = ("/bench", "/campaigns/{campaign}", "/units")
#: A bench process that was asked to end has this long, s.
ENDS_WITHIN_S = 20.0
#: How long after a stop the table is watched, s.
WATCHED_S = 4.0


@dataclass(frozen=True)
class Drawn:
    """What happens in one round."""

    seed: int
    killed_s: float  #: relative to the press of Stop now
    page: str
    size: str
    dark: bool
    reloads: bool  #: the page is loaded again instead, and its own button pressed
    successor: bool


@dataclass
class Round:
    """What came of one round."""

    drawn: Drawn
    loaded_s: float = 0.0  #: until the page had its button
    noticed_s: float | None = None  #: from the kill until the bench process answered at the address
    told_s: float | None = None  #: from the press until the table heard the stop
    said_s: float | None = None  #: from the press until NOT STOPPED was shown over everything
    gone_s: float | None = None  #: from the table's stop until the message was gone
    lied: bool = False  #: whether the message went before the table was stopped
    says_stands: bool = False
    turned_again: bool = False
    left_behind: tuple[int, ...] = ()
    shown: list[Shown] = field(default_factory=list)

    @property
    def well(self) -> bool:
        """Whether all that is promised came true."""
        told = self.told_s is not None and self.told_s <= TOLD_S
        said = self.said_s is not None and self.said_s <= SAID_S
        noticed = self.noticed_s is not None and self.noticed_s <= NOTICED_S
        true = not self.lied and self.says_stands and self.told_s is not None
        return (told or said) and noticed and true and not self.turned_again and not self.left_behind

    def __str__(self) -> str:
        drawn = self.drawn
        where = f"{drawn.page} {drawn.size}{' dark' if drawn.dark else ''}"
        what = "own page pressed" if drawn.reloads else f"killed {drawn.killed_s:+.2f} s from the press on {where}"

        def seconds(found: float | None) -> str:
            return "never" if found is None else f"{found:.2f} s"

        return (
            f"{drawn.seed}: {what}: loaded {self.loaded_s:.1f} s, noticed {seconds(self.noticed_s)}, table told "
            f"{seconds(self.told_s)}, NOT STOPPED shown {seconds(self.said_s)}, gone {seconds(self.gone_s)} after the "
            f"stop{', LIED' if self.lied else ''}{'' if self.says_stands else ', NOT SAID THAT IT STANDS'}"
            f"{', TURNED AGAIN' if self.turned_again else ''}"
            f"{f', left behind {self.left_behind}' if self.left_behind else ''}"
        )


class Watch:
    """What the table heard, at the time of day that a page has too, s since 1970."""

    def __init__(self, table: Table) -> None:
        self._table, self._ahead_s = table, time.time() - time.monotonic()

    def stopped_s(self, after_s: float) -> float | None:
        """Return when the table heard the stop first."""
        return next((at for line in self._table.heard if (at := self._at(line)) >= after_s and line.is_stop), None)

    def turned_again(self, after_s: float) -> bool:
        """Return whether the table turned after it had stood."""
        turning = [line.table_turns for line in self._table.heard if self._at(line) >= after_s]
        return False in turning and True in turning[turning.index(False) :]

    def _at(self, line: Heard) -> float:
        return line.at_s + self._ahead_s


def begin(service: Service, table: Table) -> int:
    """Start a campaign; returns its number once the table turns."""
    start = {"recipe": RECIPE, "confirmed_by": "the study", "checks": list(BENCH_CHECKS)}
    while True:
        with contextlib.suppress(httpx.HTTPError, LookupError):
            httpx.post(f"{service.url}/api/campaigns", json=start, timeout=60.0)
            campaign = int(httpx.get(f"{service.url}/api/campaigns", timeout=60.0).json()[0]["id"])
            break
        time.sleep(0.5)  # the machine is so busy that the web process was started again
    while not table.turns():
        time.sleep(0.05)
    return campaign


def kill(service: Service, *names: str) -> None:
    """Kill processes of a service, at the same time."""
    for name in names:
        with contextlib.suppress(ProcessLookupError):
            os.kill(service.pids[name], signal.SIGKILL)


def noticed(url: str, since_s: float, within_s: float = 10.0) -> float | None:
    """Return after how long the bench process's own page answers, s."""
    while time.time() - since_s < within_s:
        with contextlib.suppress(httpx.HTTPError):
            answer = httpx.get(url, timeout=5.0)
            if answer.status_code == 503 and "labctl" in answer.text:
                return time.time() - since_s
        time.sleep(0.05)
    return None


@contextmanager
def successor(service: Service, bench: Path) -> Iterator[dict[str, Any]]:
    """Run another service on the same bench, at the same address."""
    words = ["serve", "--bench", str(bench), "--port", service.url.rpartition(":")[2], "--json"]
    process = subprocess.Popen(
        [sys.executable, "-m", "labctl", *words, "--database", str(service.database)],
        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env=service.environment,
    )  # fmt: skip
    try:
        assert process.stdout is not None
        yield json.loads(process.stdout.readline())
    finally:
        process.terminate()
        process.communicate()


def waited(holds: Any, within_s: float) -> bool:
    """Wait until something holds; returns whether it does."""
    until_s = time.time() + within_s
    while not (found := holds()) and time.time() < until_s:
        time.sleep(0.02)
    return bool(found)


def one(browser: Browser, drawn: Drawn) -> Round:
    """Run one round."""
    found = Round(drawn)
    with tempfile.TemporaryDirectory() as name, simulators(Path(name)) as (bench, table):
        service = Service(Path(name), bench)
        watch = Watch(table)
        try:
            campaign = begin(service, table)
            path = "/bench" if drawn.page == "/units" else drawn.page.format(campaign=campaign)
            page = opened(browser, service.url + path, drawn.size, dark=drawn.dark)
            found.loaded_s = _loaded(page, drawn)
            pressed_s = _pressed_own(page, service, found) if drawn.reloads else _pressed(page, service, found)
            stopped = waited(lambda: watch.stopped_s(pressed_s), 20.0)
            stopped_s = watch.stopped_s(pressed_s) if stopped else None
            found.told_s = None if stopped_s is None else stopped_s - pressed_s
            _say(page, found, pressed_s, stopped_s)
            picture(page, PICTURES, f"round-{drawn.seed}-end")
            if drawn.successor:
                _succeed(page, service, bench)
            else:
                time.sleep(WATCHED_S)
            found.turned_again = stopped_s is not None and watch.turned_again(stopped_s)
        finally:
            for context in browser.contexts:
                context.close()
            found.left_behind = _ended(service)
    return found


def _loaded(page: Page, drawn: Drawn) -> float:
    """Wait until the page has its button; returns how long that took, s."""
    begun_s = time.time()
    try:
        page.get_by_role("button", name="Safe stop").wait_for()
    except Exception as error:
        picture(page, PICTURES, f"round-{drawn.seed}-not-loaded")
        raise TimeoutError("the page was not loaded in a minute") from error
    return time.time() - begun_s


def _pressed(page: Page, service: Service, found: Round) -> float:
    """Kill at the drawn moment, press Safe stop; returns when it was pressed."""
    killed: list[float] = []

    def do_kill() -> None:
        killed.append(time.time())
        kill(service, "supervisor", "web")
        found.noticed_s = noticed(service.url, killed[0])

    press_after_s = max(0.0, -found.drawn.killed_s) + 0.3
    timer = threading.Timer(press_after_s + found.drawn.killed_s, do_kill)
    timer.start()
    time.sleep(press_after_s)
    pressed_s = press_stop(page)
    if found.drawn.page == "/units":  # he goes on to another page at once
        page.evaluate("document.querySelector('a[href=\"/units\"]').click()")
    timer.join()
    return pressed_s


def _pressed_own(page: Page, service: Service, found: Round) -> float:
    """Kill, load the page again, press the button of the bench process's page; returns when it was pressed."""
    killed_s = time.time()
    kill(service, "supervisor", "web")
    found.noticed_s = noticed(service.url, killed_s)
    page.reload()
    picture(page, PICTURES, f"own-{found.drawn.seed}")
    pressed_s = time.time()
    page.get_by_role("button", name="Stop").click()
    return pressed_s


def _say(page: Page, found: Round, pressed_s: float, stopped_s: float | None) -> None:
    """Note what the page said, once it says that the table stands, or after a while."""
    if found.drawn.reloads:
        found.says_stands = waited(lambda: "at rest" in page.inner_text("body"), GONE_S)
        return
    toast = page.locator(".toasts")
    found.says_stands = waited(lambda: "Stopped" in toast.inner_text(), GONE_S)
    found.shown = shown_over(page)
    first = next((each for each in found.shown if each.plain and each.at_s >= pressed_s), None)
    if first is None:
        return
    found.said_s = first.at_s - pressed_s
    gone = next((each for each in found.shown if each.at_s > first.at_s and not each.plain), None)
    if gone is not None:
        found.lied = stopped_s is None or gone.at_s < stopped_s - 0.05
        found.gone_s = None if stopped_s is None else gone.at_s - stopped_s


def _succeed(page: Page, service: Service, bench: Path) -> None:
    """Start another service, and watch for a while."""
    with successor(service, bench):
        time.sleep(WATCHED_S)
        picture(page, PICTURES, "successor")


def _ended(service: Service) -> tuple[int, ...]:
    """End everything of a round; returns what could not be ended in order."""
    service.command("stop").wait()
    for pid in {*service.pids.values(), *service.family()}:
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGCONT)
    for pid in service.family():  # a bench process left alone ends only after a minute
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGTERM)
    waited(lambda: not service.family(), ENDS_WITHIN_S)
    return service.family()


def drawn_rounds(rounds: int) -> list[Drawn]:
    """Draw the rounds."""
    rng = np.random.default_rng(2929)
    found = []
    for k in range(rounds):
        killed_s = float(rng.uniform(-3.0, 2.0) if k % 2 else rng.uniform(-0.1, 0.2))
        page = PAGES[int(rng.integers(len(PAGES)))]
        size = ("wide", "narrow")[int(rng.integers(2))]
        found.append(Drawn(k, killed_s, page, size, bool(rng.integers(2)), k % 5 == 4, k % 3 == 0))
    return found


def run() -> dict[str, float]:
    """Run all rounds, a line for each."""
    rounds = []
    with chromium() as browser:
        for drawn in drawn_rounds(ROUNDS):
            if ONLY and drawn.seed not in ONLY:
                continue
            try:
                rounds.append(one(browser, drawn))
            except TimeoutError as error:
                print(f"   NO ROUND: {drawn.seed}: {error}", flush=True)
                continue
            print(f"   {'as promised' if rounds[-1].well else 'NOT AS PROMISED'}: {rounds[-1]}", flush=True)
    return figures(rounds)


def figures(rounds: list[Round]) -> dict[str, float]:
    """Return the figures of all rounds."""

    def spread(name: str) -> dict[str, float]:
        values = [value for each in rounds if (value := getattr(each, name)) is not None]
        stem = name.removesuffix("_s")
        return {
            f"{stem}_median_s": float(np.median(values)) if values else 0.0,
            f"{stem}_largest_s": float(max(values, default=0.0)),
        }

    return {
        "rounds": float(len(rounds)),
        "as_promised": float(sum(each.well for each in rounds)),
        "not_stopped_shown": float(sum(each.said_s is not None for each in rounds)),
        "turned_again": float(sum(each.turned_again for each in rounds)),
        "lied": float(sum(each.lied for each in rounds)),
        **spread("loaded_s"), **spread("noticed_s"), **spread("told_s"), **spread("said_s"), **spread("gone_s"),
    }  # fmt: skip

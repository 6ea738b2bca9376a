"""Random sequences of stop, kill, freeze, thaw, restart, start and resume: does a table start again after a stop?

Supervisor and bench process are labctl's own (`studies.forked_service`); the instruments are simulated in a process of
their own, and the log of the table is what counts. `LABCTL_STUDY_SEQUENCES` is how many sequences,
`LABCTL_STUDY_AT_ONCE` how many run beside each other, `LABCTL_STUDY_SEED` which ones.
"""

from __future__ import annotations

import contextlib
import os
import queue
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx
import numpy as np

from instruments.errors import InstrumentError
from labctl.answers.campaigns import BENCH_CHECKS, CampaignRequest, ResumeRequest
from labctl.errors import LabctlError
from labctl.processes.bench_methods import method_of
from labctl.processes.rpc import RpcClient
from labctl.processes.settings import CALLS, ServeRequest
from labctl.services.commands.requests import CampaignResume, CampaignStart
from labctl.stop.places import places_of
from studies import forked_service
from studies.stop_rig import RECIPE, Heard, simulators

SEQUENCES = int(os.environ.get("LABCTL_STUDY_SEQUENCES", "1000"))
AT_ONCE = int(os.environ.get("LABCTL_STUDY_AT_ONCE", "6"))
SEED = int(os.environ.get("LABCTL_STUDY_SEED", "29"))
#: Of the simulated instruments.
SPEED = 4.0
ASKED_S, STOPPED_S = 3.0, 15.0
#: How long the table is watched at the end of a sequence, once every process goes on or was started again, s.
WATCHED_S = 2.0
TURNS_WITHIN_S = 60.0
#: So much of the log is shown of a sequence that did not end as promised.
LOG_CHARACTERS = 20_000
#: Sequences run beside each other, so that the computer is busy, s.
TOLD_WITHIN_S = 5.0
#: What a sequence is drawn from, each as often as it stands here.
ACTS = (
    "stop by command", "stop by command", "stop by page", "stop by page", "stop by signal",
    "kill supervisor", "kill bench", "freeze supervisor", "freeze bench", "freeze bench", "thaw", "thaw", "restart",
    "restart", "start", "resume", "resume",
)  # fmt: skip


class NoAnswer(Exception):
    """No process answers at the address of the service."""


@dataclass
class Stop:
    """A stop that was asked for."""

    asked_s: float
    turning: bool  #: whether the table turned then
    line: int  #: how much the instruments had heard by then
    confirmed_s: float | None = None  #: when the answer came that the table stands
    unheard: bool = False  #: whether no answer came, so that the stop may have reached no process


@dataclass
class Story:
    """What was done in one sequence, and what became of it."""

    number: int
    acts: list[str] = field(default_factory=list)
    stops: list[Stop] = field(default_factory=list)
    released_s: list[float] = field(default_factory=list)  #: when a person let the bench move
    started_again: list[str] = field(default_factory=list)
    trouble: str = ""  #: what kept the sequence from being carried out

    def in_force_s(self, stop: Stop, heard: list[Heard]) -> float | None:
        """Return from when on a stop was carried out: it was confirmed, or the table heard it, in time, and stood.

        Before that another process may make the bench safe for a reason of its own, which looks the same.
        """
        if stop.confirmed_s is not None or stop.unheard:
            return stop.confirmed_s
        told = next((k for k in range(stop.line, len(heard)) if heard[k].is_stop), None)
        after = heard[told + 1 :] if told is not None else []
        stood = next((each.at_s for each in after if not each.table_turns), None)
        return None if stood is None else max(stood, stop.asked_s + TOLD_WITHIN_S)

    def judge(self, heard: list[Heard]) -> None:
        """Note every line in which a table turns that no person has released since a stop that was carried out."""
        for stop in self.stops:
            from_s = self.in_force_s(stop, heard)
            if from_s is None:
                continue
            released_s = min((at_s for at_s in self.released_s if at_s > stop.asked_s), default=float("inf"))
            turned = next((each for each in heard if from_s < each.at_s < released_s and each.shows_motion), None)
            if turned is not None:
                self.started_again.append(f"{turned.at_s - stop.asked_s:.2f} s after a stop: {turned.text!r}")


class Bench:
    """A simulated bench, and the service that drives it."""

    def __init__(self, folder: Path, opened: ExitStack) -> None:
        self.folder, self.database = folder, folder / "lab.sqlite"
        self.state, self.log = folder / "state", folder / "service.log"
        self.file, self.table = opened.enter_context(simulators(folder, SPEED))
        self.supervisor: Any = None
        self.bench_pid = 0
        self.url = ""
        self.campaign = 0

    # -- what a person does

    def start_campaign(self) -> None:
        """Start a campaign, in a person's name."""
        request = CampaignRequest(recipe=RECIPE, confirmed_by="Ada", checks=list(BENCH_CHECKS))
        self.campaign = self._ask("control.start", CampaignStart(request)).id

    def resume_campaign(self) -> None:
        """Resume the last campaign, in a person's name."""
        self._ask("control.resume", CampaignResume(self.campaign, ResumeRequest(by="Ada")))

    def _ask(self, name: str, asked: object) -> Any:
        note = places_of(str(self.database))[0].note()
        assert note is not None
        caller = RpcClient(Path(note.socket).parent / CALLS, ASKED_S, method_of)
        try:
            return caller.call(name, asked)
        finally:
            caller.close()

    def stop(self, way: str) -> bool | None:
        """Ask for a stop; returns whether the table is said to stand, None where nothing can be said.

        Raises NoAnswer where the page, which then shows NOT STOPPED, gets no answer, and where there is no supervisor
        to signal: a shell then says that there is no such process.
        """
        if way == "signal":
            if not self.serves:
                raise NoAnswer
            try:
                os.kill(self.supervisor.pid, signal.SIGTERM)
            except ProcessLookupError as error:
                raise NoAnswer from error
            return None
        if way == "page":
            url = f"{self.url}/api/campaigns/{max(self.campaign, 1)}/abort"
            try:
                answer = httpx.post(url, json={"by": "Ada", "reason": "study"}, timeout=STOPPED_S)
            except httpx.HTTPError as error:
                raise NoAnswer from error
            return bool(answer.json().get("stands"))
        words = [sys.executable, "-m", "labctl", "stop", "--database", str(self.database)]
        environment = {**os.environ, "XDG_STATE_HOME": str(self.state)}
        return subprocess.run(words, capture_output=True, env=environment, timeout=90.0, check=False).returncode == 0

    # -- what happens to the processes

    @property
    def serves(self) -> bool:
        """Whether there is a supervisor."""
        return self.supervisor is not None and self.supervisor.exitcode is None

    def pid_of(self, which: str) -> int:
        """Return a process of the service: the bench process is the one that drives now."""
        if which == "supervisor":
            return int(self.supervisor.pid)
        found = [place.note() for place in places_of(str(self.database))]
        return next((note.driver.pid for note in found if note is not None and note.driver.lives), 0)

    def signal(self, which: str, number: signal.Signals) -> None:
        """Send a signal to a process, if it lives."""
        pid = self.pid_of(which)
        if pid and (which == "bench" or self.serves):
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, number)

    def thaw(self) -> None:
        """Let every process go on."""
        for which in ("supervisor", "bench"):
            self.signal(which, signal.SIGCONT)

    def serve(self) -> None:
        """Start a service; whatever supervisor is left is killed."""
        if self.serves:
            self.signal("supervisor", signal.SIGKILL)
            self.supervisor.join()
        request = ServeRequest(bench=str(self.file), port=0, database=str(self.database))
        self.supervisor, ready = forked_service.start(request, self.state, self.log)
        if ready is None:
            raise RuntimeError("the service did not start")
        self.url = ready.url

    def close(self) -> None:
        """End every process."""
        for which in ("supervisor", "bench"):
            self.signal(which, signal.SIGKILL)


def tell(bench: Bench, story: Story, rng: np.random.Generator) -> None:
    """Carry out one random sequence."""
    _begin_turning(bench, story)
    acts = [str(rng.choice(ACTS)) for _ in range(int(rng.integers(3, 9)))]
    if not any(act.startswith("stop") for act in acts):
        acts[int(rng.integers(len(acts)))] = "stop by command"
    for act in acts:
        time.sleep(float(rng.exponential(0.4)))
        _carry_out(bench, story, act)
    bench.thaw()
    if not bench.serves:
        _carry_out(bench, story, "restart")
    time.sleep(WATCHED_S)
    _carry_out(bench, story, "stop by command")
    story.judge(bench.table.heard)


def _begin_turning(bench: Bench, story: Story) -> None:
    """Have a table that turns, begun by a person."""
    until_s, refused = time.monotonic() + TURNS_WITHIN_S, ""
    while not bench.table.turns():
        if not bench.serves:  # also one that was asked to end in the sequence before, and has ended since
            bench.serve()
        if time.monotonic() > until_s:
            raise RuntimeError(f"the table did not turn: {refused}")
        story.released_s.append(time.monotonic())
        try:
            bench.start_campaign()
        except (LabctlError, InstrumentError) as error:
            refused = str(error)
        for _ in range(100):
            if bench.table.turns():
                break
            time.sleep(0.05)


def _carry_out(bench: Bench, story: Story, act: str) -> None:
    verb, _, what = act.partition(" ")
    story.acts.append(act)
    if verb == "stop":
        stop = Stop(time.monotonic(), bench.table.turns(), len(bench.table.heard))
        story.stops.append(stop)
        try:
            if bench.stop(what.removeprefix("by ")):
                stop.confirmed_s = time.monotonic()
        except NoAnswer:
            stop.unheard = True
        return
    if verb in {"start", "resume"}:
        story.released_s.append(time.monotonic())
    acts: dict[str, Callable[[], None]] = {
        "start": bench.start_campaign, "resume": bench.resume_campaign, "thaw": bench.thaw, "restart": bench.serve,
        "kill": lambda: bench.signal(what, signal.SIGKILL), "freeze": lambda: bench.signal(what, signal.SIGSTOP),
    }  # fmt: skip
    with contextlib.suppress(LabctlError, InstrumentError):  # refused, or no answer: that is among what may happen
        acts[verb]()


def _work(numbers: queue.SimpleQueue[int], stories: list[Story]) -> None:
    """Carry out sequences on one bench, as long as there are any; a bench on which one failed is replaced."""
    while not numbers.empty():
        with ExitStack() as opened:
            bench = Bench(Path(opened.enter_context(tempfile.TemporaryDirectory())), opened)
            opened.callback(bench.close)
            while True:
                try:
                    number = numbers.get_nowait()
                except queue.Empty:
                    return
                story = Story(number)
                stories.append(story)
                try:
                    tell(bench, story, np.random.default_rng([SEED, number]))
                except Exception as error:  # noqa: BLE001  it is reported with the sequence
                    story.trouble = f"{type(error).__name__}: {error}"
                _report(story, len(stories))
                if story.trouble or story.started_again:
                    print(bench.log.read_text()[-LOG_CHARACTERS:], flush=True)
                    break
                bench.table.heard.clear()


def _report(story: Story, so_far: int) -> None:
    if story.started_again or story.trouble:
        print(
            f"   sequence {story.number}: {story.started_again or story.trouble}; {', '.join(story.acts)}", flush=True
        )
    elif so_far % 50 == 0:
        print(f"   {so_far} sequences", flush=True)


def run() -> dict[str, float]:
    """Carry out all sequences."""
    numbers: queue.SimpleQueue[int] = queue.SimpleQueue()
    for number in range(SEQUENCES):
        numbers.put(number)
    stories: list[Story] = []
    workers = [threading.Thread(target=_work, args=(numbers, stories)) for _ in range(AT_ONCE)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    stops = [stop for story in stories for stop in story.stops]
    acts = Counter(act.split()[0] for story in stories for act in story.acts)
    return {
        "sequences": float(len(stories)),
        "not_carried_out": float(sum(bool(story.trouble) for story in stories)),
        "started_again": float(sum(bool(story.started_again) for story in stories)),
        "stops": float(len(stops)),
        "stops_of_a_turning_table": float(sum(stop.turning for stop in stops)),
        "stops_confirmed": float(sum(stop.confirmed_s is not None for stop in stops)),
        **{f"acts_{name}": float(count) for name, count in sorted(acts.items())},
    }

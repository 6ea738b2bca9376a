"""The bench process as the web process and its workers see it."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from instruments.bench_config import BenchFile
from labctl.errors import BenchSilent, Conflict
from labctl.log import get_logger
from labctl.processes.bench_calls import Beat
from labctl.processes.calls import Call, Caller
from labctl.processes.liveness import Elapsed
from labctl.processes.settings import CALLS, STOP
from labctl.services.benches.bench_left import BenchLeft
from labctl.services.campaigns.listeners import ChangeListeners
from labctl.services.commands.context import CommandContext
from labctl.services.commands.requests import CampaignResume, CampaignStart, ToBench, ToCampaign
from labctl.services.commands.service_control import NO_BENCH
from labctl.services.schemas.benches import BenchCheckResponse, BenchDescription, CheckRequest
from labctl.services.schemas.campaigns import CampaignResponse, ConfirmRequest, ReasonRequest
from labctl.services.schemas.schedule import ScheduledResponse

log = get_logger()

#: A question that the bench process answers from its memory.
ANSWER_S = 3.0
#: A transaction: the engine may have the writing connection for a moment.
TRANSACTION_S = 30.0
#: Opening a bench: every instrument is asked.
OPENING_S = 180.0
#: A stop is passed on without waiting for anything.
STOP_S = 1.0
#: A bench process without an answer for so long gets no request but to stop.
SILENT_S = 3.0
RECONNECT_S = 0.5


class RemoteWriter:
    """Runs transactions in the bench process. It can be pickled: the copy reaches the same process."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._caller = Caller(folder / CALLS, TRANSACTION_S)

    def run(self, name: str, args: tuple[object, ...], kwargs: Mapping[str, object]) -> object:
        """Run a transaction there; returns or raises what it did. Raises BenchSilent."""
        return self._caller.call(f"store.{name}", args, kwargs)

    def __reduce__(self) -> tuple[type[RemoteWriter], tuple[Path]]:
        """Return what unpickling calls in another process."""
        return RemoteWriter, (self._folder,)

    def close(self) -> None:
        """Close the connections."""
        self._caller.close()


class RemoteControl:
    """Control over the campaigns of the bench process."""

    def __init__(self, folder: Path, bench: BenchFile | None) -> None:
        self._bench = bench
        self._calls, self._stop = Caller(folder / CALLS, ANSWER_S), Caller(folder / STOP, STOP_S, keeps=False)

    def bench_of(self, _: CampaignStart) -> BenchFile:
        """Return the bench of the bench process. Raises Conflict without one."""
        if self._bench is None:
            raise Conflict(NO_BENCH)
        return self._bench

    def start(self, _: CommandContext, asked: CampaignStart) -> CampaignResponse:
        """Start a campaign on the bench."""
        return self._ask("start", asked, timeout_s=OPENING_S)

    def schedule(self, _: CommandContext, asked: CampaignStart) -> ScheduledResponse:
        """Enter a campaign into the schedule of the bench."""
        return self._ask("schedule", asked, timeout_s=TRANSACTION_S)

    def resume(self, _: CommandContext, asked: CampaignResume) -> CampaignResponse:
        """Continue a paused campaign, or resume an interrupted one."""
        return self._ask("resume", asked, timeout_s=OPENING_S)

    def pause(self, _: CommandContext, asked: ToCampaign[ReasonRequest]) -> CampaignResponse:
        """Ask a running campaign to hold after the present data set."""
        return self._ask("pause", asked, timeout_s=TRANSACTION_S)

    def abort(self, _: CommandContext, asked: ToCampaign[ReasonRequest]) -> CampaignResponse:
        """End a campaign now, in the safe state: first the stop, by a way of its own; then it is written down."""
        stopped = self._stop.call("stop", asked.campaign, asked.body.text)
        try:
            return self._ask("abort", asked, timeout_s=ANSWER_S)
        except BenchSilent as silent:
            if not stopped:
                raise
            raise BenchSilent(
                f"labctl has requested the stop of campaign {asked.campaign}, but it is not known whether the "
                f"campaign has stopped: {silent}; inspect the bench"
            ) from silent

    def confirm(self, _: CommandContext, asked: ToCampaign[ConfirmRequest]) -> CampaignResponse:
        """Answer the question that a campaign waits for."""
        return self._ask("confirm", asked, timeout_s=TRANSACTION_S)

    def check(self, _: CommandContext, asked: ToBench[CheckRequest]) -> BenchCheckResponse:
        """Ask every instrument of the bench what it is and how it does."""
        return self._ask("check", asked, timeout_s=OPENING_S)

    def _ask(self, act: str, asked: object, timeout_s: float) -> Any:
        return self._calls.call(f"control.{act}", asked, timeout_s=timeout_s)

    def close(self) -> None:
        """Close the connections."""
        self._calls.close()
        self._stop.close()


class RemoteBench:
    """The bench of a service whose bench process drives it."""

    def __init__(self, folder: Path, bench: BenchFile | None) -> None:
        self.bench = bench
        self.control = RemoteControl(folder, bench)
        self._caller = Caller(folder / CALLS, ANSWER_S)
        self._listeners = ChangeListeners()
        self._beat = Beat(running=None, stops=False, schedule_trouble="")
        self._heard = Elapsed()
        self._silent = False
        self._last_live: CampaignResponse | None = None
        self._described: BenchDescription | None = None
        self._over = threading.Event()
        self._watch: threading.Thread | None = None

    @property
    def stops(self) -> bool:
        """Whether no campaign is started any more because the service ends."""
        return self._beat.stops or self._over.is_set()

    @property
    def running(self) -> int | None:
        """The campaign that ran when the bench process last answered."""
        return self._beat.running

    @property
    def schedule_trouble(self) -> str:
        """Why the schedule could not be read; empty when all is well."""
        return self._beat.schedule_trouble

    @property
    def heard_s(self) -> float:
        """Time since the last answer of the bench process, s."""
        return self._heard.s

    @property
    def _silence(self) -> str:
        return f"the bench process has not answered for {self.heard_s:.0f} s: the bench may move; inspect it"

    def _ask(self, name: str, *args: Any) -> Any:
        if self.heard_s > SILENT_S:
            raise BenchSilent(self._silence)
        return self._caller.call(name, *args)

    def runs(self, campaign: int) -> bool:
        """Whether this campaign runs now, or did when the bench process last answered."""
        try:
            return bool(self._ask("bench.live", campaign)[0])
        except BenchSilent:
            return self._last_live is not None and self._last_live.id == campaign

    def status(self, campaign: int) -> CampaignResponse | None:
        """Return the live picture of a campaign that runs, else None.

        While the bench process does not answer it is the last picture, which then says that the process is silent.
        """
        try:
            running, live = self._ask("bench.live", campaign)
        except BenchSilent:
            last = self._last_live
            if last is None or last.id != campaign:
                return None
            return last.model_copy(update={"last_error": self._silence, "links": {"bench process": "lost"}})
        if live is not None:
            self._last_live = live
        elif self._last_live is not None and self._last_live.id == campaign and not running:
            self._last_live = None
        answer: CampaignResponse | None = live
        return answer

    def listen(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Call `listener` at every change; returns the function that ends this. A listener may not block."""
        return self._listeners.add(listener)

    def describe(self) -> BenchDescription | None:
        """Return the bench and what it is doing; what was last known, as unconfirmed, while its process is silent."""
        if self.bench is None:
            return None
        with contextlib.suppress(BenchSilent):
            self._described = self._ask("bench.describe")
        known = self._described or BenchDescription(
            name=self.bench.name, simulated=self.bench.is_simulated, latitude_deg=self.bench.latitude_deg, units=[],
            campaign=None, unconfirmed="",
        )  # fmt: skip
        silent = {"unconfirmed": self._silence} if self.heard_s > SILENT_S else {}
        return known.model_copy(update={**silent, "heard_s": round(self.heard_s, 1)})

    def start(self) -> None:
        """Hear of the bench process from now on; what it begins, it begins by itself."""
        self._watch = threading.Thread(target=self._keep_watching, name="bench-watch", daemon=True)
        self._watch.start()

    def _keep_watching(self) -> None:
        while not self._over.is_set():
            with contextlib.suppress(BenchSilent, EOFError, OSError):
                self._hear()
            if self.heard_s > SILENT_S and not self._over.is_set():
                self._note(silent=True)
            self._listeners.notify()
            self._over.wait(RECONNECT_S)

    def _hear(self) -> None:
        with self._caller.connect() as connection:
            connection.send(Call("watch"))
            while not self._over.is_set():
                if not connection.poll(SILENT_S):
                    self._note(silent=True)
                    self._listeners.notify()  # silence is a change too
                    continue
                self._beat = connection.recv()
                self._heard.restart()
                self._note(silent=False)
                self._listeners.notify()

    def _note(self, *, silent: bool) -> None:
        if silent and not self._silent:
            log.error("bench_process.silent", silent_s=round(self.heard_s, 1))
        elif self._silent and not silent:
            log.warning("bench_process.heard")
        self._silent = silent

    def end_soon(self) -> None:
        """Nothing: the supervisor ends the bench process, not the web process."""

    def close(self) -> BenchLeft:
        """Let the bench process go on without this one; it says itself how it leaves the bench."""
        self._over.set()
        self._caller.close()
        self.control.close()
        if self._watch is not None:
            self._watch.join()
        return BenchLeft()

"""The bench process as the web process and its workers see it."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Mapping
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any, cast

from instruments.bench_config import BenchFile
from labctl.acting_user import actor
from labctl.answers.benches import BenchDescription, StopResponse
from labctl.answers.campaigns import CampaignResponse, ReasonRequest
from labctl.answers.live import LiveHistoryResponse, LiveStateResponse
from labctl.errors import BenchSilent, Conflict, LabctlError, NotStopped
from labctl.log import get_logger
from labctl.processes.bench_methods import Beat, method_of
from labctl.processes.documents import receive, value_of
from labctl.processes.liveness import Elapsed
from labctl.processes.rpc import RpcClient
from labctl.processes.settings import CALLS
from labctl.services.benches.bench_left import BenchLeft
from labctl.services.benches.stops import describe_stop, late_stop
from labctl.services.campaigns.listeners import ChangeListeners
from labctl.services.commands.acts.abort import ABORT
from labctl.services.commands.context import WRITES_S, BenchAct, CommandContext, RequestT, ResponseT
from labctl.services.commands.requests import CampaignStart, ToCampaign
from labctl.services.commands.service_control import WITHOUT_BENCH
from labctl.stop.client import StopAttempt, not_stopped_text
from labctl.stop.latch import LatchState, StopRequest
from labctl.stop.places import BenchPlace, place_of

log = get_logger()

#: A question that the bench process answers from its memory.
ANSWER_S = 3.0
#: A stop is answered within this: that the table stands, or that the bench is not stopped, s.
STANDS_S = 4.5
#: A bench process without an answer for so long gets no request but to stop.
SILENT_S = 3.0
RECONNECT_S = 0.5
#: The same request, by the page of the supervisor and again here: what comes later is another one.
REPEATED_WITHIN = timedelta(seconds=10)


class RemoteWriter:
    """Runs transactions in the bench process. It can be pickled: the copy reaches the same process."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._caller = RpcClient(folder / CALLS, WRITES_S, method_of)

    def run(self, name: str, args: tuple[object, ...], kwargs: Mapping[str, object]) -> object:
        """Run a transaction there; returns or raises what it did. Raises BenchSilent."""
        return self._caller.call(f"store.{name}", *args, **cast(Mapping[str, Any], kwargs))

    def __reduce__(self) -> tuple[type[RemoteWriter], tuple[Path]]:
        """Return what unpickling calls in another process."""
        return RemoteWriter, (self._folder,)

    def close(self) -> None:
        """Close the connections."""
        self._caller.close()


class RemoteControl:
    """Control over the campaigns of the bench process."""

    def __init__(
        self,
        folder: Path,
        bench: BenchFile | None,
        place: BenchPlace | None = None,
        may_run: Callable[[int], bool] = lambda _: True,
        last_live: Callable[[int], CampaignResponse | None] = lambda _: None,
    ) -> None:
        """`may_run`: whether a campaign runs, or may; `last_live`: how it was when the bench process answered last."""
        self._bench, self._place = bench, place
        self._may_run, self._last_live = may_run, last_live
        self._calls = RpcClient(folder / CALLS, ANSWER_S, method_of)

    def bench_of(self, _: CampaignStart) -> BenchFile:
        """Return the bench of the bench process. Raises Conflict without one."""
        if self._bench is None:
            raise Conflict(WITHOUT_BENCH)
        return self._bench

    def own_bench(self) -> BenchFile | None:
        """Return the bench of the bench process. Raises Conflict without one."""
        if self._bench is None:
            raise Conflict(WITHOUT_BENCH)
        return self._bench

    def perform(self, act: BenchAct[RequestT, ResponseT], _: CommandContext, request: RequestT) -> ResponseT:
        """Have the bench process carry out an act; an abort stops the bench by a way of its own first."""
        if act.name == ABORT.name:
            return cast(ResponseT, self._abort(cast(ToCampaign[ReasonRequest], request)))
        return self._ask(act, request, act.wait_s)

    def _abort(self, request: ToCampaign[ReasonRequest]) -> CampaignResponse:
        """End a campaign now, in the safe state: first the stop, by a way of its own; then it is written down.

        Raises NotStopped where it is not confirmed within some seconds that the table stands.
        """
        if self._place is None or not self._may_run(request.campaign):
            return self._recorded(request)
        attempt = self._attempt(request.body.text, request.campaign)
        outcome = attempt.result(STANDS_S)
        if outcome is None or not outcome.stands:
            raise NotStopped(not_stopped_text(attempt.text))
        try:
            return self._recorded(request)
        except BenchSilent as silent:
            last = self._last_live(request.campaign)
            if last is None:
                raise BenchSilent(
                    f"the table stands ({attempt.text}), but that is not recorded yet; try again once the bench "
                    f"process answers: {silent}"
                ) from silent
            text = f"the table stands, but that is not recorded yet: {silent}"
            return last.model_copy(update={"wish": "abort", "step_text": attempt.text, "unrecorded": text})

    def stop(self, reason: str) -> StopResponse:
        """Stop the bench, whatever runs there. Raises NotStopped, Conflict without a bench."""
        if self._place is None or self._bench is None:
            raise Conflict(WITHOUT_BENCH)
        attempt = self._attempt(reason, None)
        outcome = attempt.result(STANDS_S)
        if outcome is None or not outcome.stands:
            raise NotStopped(not_stopped_text(attempt.text))
        return StopResponse(bench=self._bench.name, stands=True, text=outcome.text, campaign=outcome.campaign)

    def _attempt(self, reason: str, campaign: int | None) -> StopAttempt:
        assert self._place is not None
        stop = StopRequest.new(actor().name, actor().via, reason, campaign)
        return StopAttempt(self._place, _asked_before(stop, self._place.latch.state()) or stop)

    def _recorded(self, request: ToCampaign[ReasonRequest]) -> CampaignResponse:
        return self._ask(ABORT, request, ANSWER_S)

    def _ask(self, act: BenchAct[RequestT, ResponseT], request: RequestT, timeout_s: float) -> ResponseT:
        return self._calls.call(f"control.{act.name}", request, timeout_s=timeout_s)

    def close(self) -> None:
        """Close the connections."""
        self._calls.close()


def _asked_before(stop: StopRequest, latch: LatchState) -> StopRequest | None:
    """Return the stop in the latch that this one repeats, so that it is carried out and recorded once; None: it is new.

    While the web process is late its supervisor carries out a stop, and may then pass the same request on to it.
    """
    for known in reversed(latch.held):
        with contextlib.suppress(ValueError):
            age = datetime.fromisoformat(stop.at) - datetime.fromisoformat(known.at)
            if (known.reason, known.campaign) == (stop.reason, stop.campaign) and age < REPEATED_WITHIN:
                return known
    return None


class RemoteBench:
    """The bench of a service whose bench process drives it."""

    def __init__(self, folder: Path, bench: BenchFile | None, location: str = "") -> None:
        """`location` is the database, beside which the latch of the bench lies."""
        self.bench = bench
        self._place = None if bench is None or not location else place_of(location, bench.name)
        self.control = RemoteControl(folder, bench, self._place, self._may_run, self._last_of)
        self._caller = RpcClient(folder / CALLS, ANSWER_S, method_of)
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
    def not_stopped(self) -> str:
        """What is known of a stop that is late; empty where none is."""
        if self.heard_s <= SILENT_S:
            return self._beat.not_stopped
        return "" if self._place is None or self.bench is None else late_stop(self._latch_state(), self.bench.name)

    def _latch_state(self) -> LatchState:
        return LatchState() if self._place is None else self._place.latch.state()

    def _may_run(self, campaign: int) -> bool:
        return self.heard_s > SILENT_S or self._beat.running == campaign

    def _last_of(self, campaign: int) -> CampaignResponse | None:
        last = self._last_live
        return last if last is not None and last.id == campaign else None

    def stop(self, reason: str) -> StopResponse:
        """Stop the bench, whatever runs there. Raises NotStopped, Conflict without a bench."""
        return self.control.stop(reason)

    @property
    def _silence(self) -> str:
        return f"the bench process has not answered for {self.heard_s:.0f} s: the bench may move; inspect it"

    def _ask(self, name: str, *args: Any, **kwargs: Any) -> Any:
        if self.heard_s > SILENT_S:
            raise BenchSilent(self._silence)
        return self._caller.call(name, *args, **kwargs)

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
        silent: dict[str, Any] = {}
        if self.heard_s > SILENT_S:
            stop = describe_stop(self._latch_state(), self.bench.name)
            silent = {"unconfirmed": self._silence, "stop": stop}
        return known.model_copy(update={**silent, "heard_s": round(self.heard_s, 1)})

    def live_state(self, *, watched: bool = False) -> LiveStateResponse:
        """Return the live calibration that runs, or the last. Raises BenchSilent."""
        answer: LiveStateResponse = self._ask("bench.live_state", watched=watched)
        return answer

    def live_history(self) -> LiveHistoryResponse:
        """Return how U fell in it. Raises BenchSilent."""
        answer: LiveHistoryResponse = self._ask("bench.live_history")
        return answer

    def start(self) -> None:
        """Hear of the bench process from now on; what it begins, it begins by itself."""
        self._watch = threading.Thread(target=self._keep_watching, name="bench-watch", daemon=True)
        self._watch.start()

    def _keep_watching(self) -> None:
        while not self._over.is_set():
            with contextlib.suppress(LabctlError, EOFError, OSError):  # silent, ended, or of another version
                self._hear()
            if self.heard_s > SILENT_S and not self._over.is_set():
                self._note(silent=True)
            self._listeners.notify()
            self._over.wait(RECONNECT_S)

    def _hear(self) -> None:
        with self._caller.connect() as connection:
            form = method_of("watch")
            connection.send_bytes(form.call())
            while not self._over.is_set():
                if not connection.poll(SILENT_S):
                    self._note(silent=True)
                    self._listeners.notify()  # silence is a change too
                    continue
                self._beat = value_of(form.result, receive(connection))
                self._heard.restart()
                self._note(silent=False)
                self._listeners.notify()

    def _note(self, *, silent: bool) -> None:
        if silent and (self.stops or self._over.is_set()):  # it has ended in order, and this process ends too
            return
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

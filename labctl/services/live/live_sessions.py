"""The live calibrations of a service: one at a time, each in a thread of its own, from its stream to the database.

A session ends at its target, at the end of its stream, when a person, a stop of the bench or the end of the service
asks for it, and, only where the person wanted that, when no page has followed it for `UNWATCHED_S`. However it ends,
the readings until then become a recording.
"""

from __future__ import annotations

import contextvars
import threading
from collections.abc import Callable
from functools import partial

from instruments.clock import Clock, SystemClock
from instruments.errors import InstrumentError
from labctl.acting_user import actor
from labctl.answers.live import LiveEndRequest, LiveHistoryResponse, LiveRequest, LiveResponse, LiveStateResponse
from labctl.errors import BadInput, Conflict, LabctlError
from labctl.fitting.live import PoseRequest, Target
from labctl.log import get_logger
from labctl.recording import RecordingInfo
from labctl.recording.line_stream import LineDecoder
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.campaigns.listeners import ChangeListeners
from labctl.services.commands.command import LocalExecutor
from labctl.services.commands.context import CommandContext
from labctl.services.commands.service_control import WITHOUT_BENCH, ServiceControl
from labctl.services.live.assessor import BackgroundAssessor, InlineAssessor
from labctl.services.live.feeds import network_feed
from labctl.services.live.gyro_source import GyroSource
from labctl.services.live.line_source import LineSource, info_of
from labctl.services.live.session_record import SessionRecord
from labctl.services.live.source import Block, LiveSource, StreamEnded
from labctl.services.planning.loading import with_drivers
from labctl.services.recordings.live_folders import folders_of, kept_readings, usual_folder
from labctl.store import Store


class EndingSource:
    """A source that ends before its next block once it was asked to, or was not watched for too long."""

    def __init__(self, source: LiveSource, clock: Clock, unwatched_s: float | None) -> None:
        """`clock` is that of the service; `unwatched_s`: it ends without a watcher for so long; None: it does not."""
        self._source, self._watch_clock, self._unwatched_s = source, clock, unwatched_s
        self._why = ""
        self._watched_s = clock.now_s()
        self.name, self.serial, self.is_simulated = source.name, source.serial, source.is_simulated
        self.clock = source.clock

    def end(self, why: str) -> None:
        """End it before its next block; the first reason counts. Returns at once."""
        self._why = self._why or why

    def watched(self) -> None:
        """Note that a page follows it now."""
        self._watched_s = self._watch_clock.now_s()

    def start(self) -> RecordingInfo:
        """Open the stream."""
        return self._source.start()

    def read(self, duration_s: float) -> Block:
        """Return the next block. Raises StreamEnded where it is to end, and what the source raises."""
        unwatched_s = self._watch_clock.now_s() - self._watched_s
        if self._unwatched_s is not None and unwatched_s > self._unwatched_s:
            self.end(f"no page had followed it for {self._unwatched_s:.0f} s, and it was to end then")
        if self._why:
            raise StreamEnded(self._why, "interrupted")
        return self._source.read(duration_s)

    def ask(self, request: PoseRequest | None) -> None:
        """Pass on what the person is asked for."""
        self._source.ask(request)

    def stop(self) -> None:
        """Close the stream."""
        self._source.stop()


log = get_logger()

#: A session that ends unwatched ends after so long without a page that follows it, s.
UNWATCHED_S = 30.0
#: A stream is closed within this once it was asked to end, s: a block, and what the instrument takes to answer.
CLOSED_WITHIN_S = 10.0


class LiveSessions:
    """Begins, shows and ends live calibrations. All of it may be called by any thread."""

    def __init__(
        self, store: Store, clock: Clock, runner: BenchRunner | None, stream_clock: Callable[[], Clock] = SystemClock
    ) -> None:
        """`stream_clock` makes the clock of a stream of the network; the bench has its own."""
        self._store, self._clock, self._runner, self._stream_clock = store, clock, runner, stream_clock
        self._guard = threading.Lock()
        self._listeners = ChangeListeners()
        self._record: SessionRecord | None = None
        self._ending: EndingSource | None = None
        self._thread: threading.Thread | None = None
        self._stops = False
        kept_sessions = kept_readings(store.location, store)
        self._kept = folders_of(kept_sessions)
        for each in kept_sessions:
            log.warning("live.kept", text=each.text)

    def listen(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Call `listener` at every change; returns the function that ends this. A listener may not block."""
        return self._listeners.add(listener)

    def start(self, request: LiveRequest) -> LiveStateResponse:
        """Begin one. Raises Conflict while another runs or without a bench, BenchBusy while a campaign has the bench,
        BadInput for a target or a stream that cannot be, and what opening the stream raises.
        """
        target = Target(request.target_u, request.target_bias_dps, request.poses, request.rest_s)
        with self._guard:
            if self._stops:
                raise Conflict("the service ends, and begins no live calibration; start the service again first")
            if self._record is not None and not self._record.is_over:
                raise Conflict(
                    f"a live calibration of {self._record.serial} runs in this service now; wait for its end, or end it"
                )
            return self._begin(request, target)

    def _begin(self, request: LiveRequest, target: Target) -> LiveStateResponse:
        if request.address is not None:
            self._open(request, target, self._line_source(request), None)
        else:
            runner = self._runner
            if runner is None:
                raise Conflict(f"{WITHOUT_BENCH}; name the address of a stream")
            serial = request.serial or runner.bench.gyros[0].serial
            runner.lend(serial, self._end_and_wait, partial(self._open_bench, request, target, runner))
        answer = self.state()
        detail = {"stream": answer.stream, "bench": answer.bench}
        self._store.audit.record(self._clock.utc(), "live start", f"unit {answer.serial}", detail)
        return answer

    def _open(self, request: LiveRequest, target: Target, source: LiveSource, runner: BenchRunner | None) -> None:
        ending = EndingSource(source, self._clock, UNWATCHED_S if request.end_unwatched else None)
        number = 1 + (0 if self._record is None else self._record.number)
        bench = "" if runner is None else runner.bench.name
        record = SessionRecord(
            number, source.serial, source.name, bench, actor().name, self._clock.utc(), target, request.end_unwatched,
            self._listeners.notify,
        )  # fmt: skip
        self._record, self._ending = record, ending
        run, context = partial(self._run, record, ending, runner), contextvars.copy_context()
        self._thread = threading.Thread(target=context.run, args=(run,), name=f"live-{number}")
        self._thread.start()

    def _open_bench(self, request: LiveRequest, target: Target, runner: BenchRunner, clock: Clock) -> None:
        self._open(request, target, GyroSource(with_drivers(runner.bench), request.serial, clock), runner)

    def _line_source(self, request: LiveRequest) -> LiveSource:
        if request.serial is None:
            raise BadInput("the stream does not say which unit it is; give its serial number (serial)")
        clock = self._stream_clock()
        info = info_of(request.serial, clock, request.latitude_deg)
        return LineSource(network_feed(request.address or "", request.topic), LineDecoder(), info, clock)

    def _run(self, record: SessionRecord, ending: EndingSource, runner: BenchRunner | None) -> None:
        try:
            record.end(self._calibrate(record, ending, runner))
        except (LabctlError, InstrumentError, OSError) as error:
            record.fail(str(error))
            log.error("live.failed", serial=record.serial, error=str(error))
        except Exception as error:
            record.fail(f"labctl failed ({error}); the readings so far are kept")
            log.exception("live.failed", serial=record.serial)

    def _calibrate(self, record: SessionRecord, ending: EndingSource, runner: BenchRunner | None) -> LiveResponse:
        """Run to the end; the bench is given back, and what is kept in folders is known, before it is over."""
        from labctl.services.live.calibrate import calibrate_live  # noqa: PLC0415  slow to import: a bench loads no fits

        assessor = InlineAssessor() if ending.is_simulated else BackgroundAssessor()  # a real stream goes on meanwhile
        commands = LocalExecutor(CommandContext(lambda: self._store, self._clock, ServiceControl(None)))
        stamp = f"{self._clock.utc():%Y%m%dT%H%M%S%f}Z"
        folder = usual_folder(self._store.location, record.serial, stamp)
        try:
            return calibrate_live(
                commands, ending, record.target, assessor, folder, keep_folder=False, show=record.show, say=record.say,
                attended=record.streaming(lambda: _give_back(runner)), fits_anyway=lambda: record.fits_anyway,
            )  # fmt: skip
        finally:
            _give_back(runner)
            self._kept = folders_of(kept_readings(self._store.location, self._store))

    def end(self, request: LiveEndRequest) -> LiveStateResponse:
        """End the one that runs, and wait until its recording is stored. Raises Conflict where none runs."""
        with self._guard:
            record, ending = self._record, self._ending
            if record is None or ending is None or not record.is_running:
                raise Conflict("no live calibration runs in this service, so there is nothing to end; start one first")
            record.fits_anyway = request.fit
            reason = f": {request.reason}" if request.reason else ""
            ending.end(f"{actor().name or 'a person'} ended it{reason}")
            self._store.audit.record(
                self._clock.utc(), "live end", f"unit {record.serial}", {"fit": request.fit, "reason": request.reason}
            )
        record.wait(CLOSED_WITHIN_S)
        return self.state()

    def _end_and_wait(self, why: str) -> None:
        record, ending = self._record, self._ending
        if record is not None and ending is not None:
            ending.end(why)
            record.wait_closed(CLOSED_WITHIN_S)

    def state(self, *, watched: bool = False) -> LiveStateResponse:
        """Return the one that runs, or the last; `watched`: a page follows it."""
        record, ending = self._record, self._ending
        if watched and ending is not None:
            ending.watched()
        return SessionRecord.none(self._kept) if record is None else record.answer(self._kept)

    def history(self) -> LiveHistoryResponse:
        """Return how U fell, fit by fit."""
        record = self._record
        if record is None:
            return LiveHistoryResponse(number=0, t_s=[], poses=[], coefficients=[])
        return record.history.answer(record.number)

    def end_soon(self) -> None:
        """Begin none any more, and let the one that runs end; returns at once."""
        self._stops = True
        if self._ending is not None:
            self._ending.end("the service ended")

    def close(self) -> None:
        """End the one that runs; its recording is stored when this returns."""
        self.end_soon()
        with self._guard:
            thread = self._thread
        if thread is not None:
            thread.join()


def _give_back(runner: BenchRunner | None) -> None:
    if runner is not None:
        runner.live.take_back()

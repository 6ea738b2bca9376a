"""A stop from the side of the one who asks: the bench process, else its guardian, else the instruments themselves."""

from __future__ import annotations

import contextlib
import os
import select
import signal
import threading
from collections.abc import Callable
from dataclasses import dataclass

from instruments.clock import SystemClock
from labctl.stop.latch import StopRequest
from labctl.stop.places import BenchPlace, DriverNote, ProcessId
from labctl.stop.wire import LAST, Word, ask

#: A bench process answers at once; one that is busy with an instrument leaves its step within a second, s.
HEARD_WITHIN_S = 1.5
#: A guardian answers at once, also on a busy computer, s.
GUARDIAN_ANSWERS_S = 1.5
#: A stop that goes on says so at least this often, s.
SILENT_S = 3.0
#: From the highest rate to rest a table takes some seconds, a guardian tries each part of the safe state twice, s.
STANDS_WITHIN_S = 60.0
#: From here on it is reported that the bench is not stopped yet, s after the one who asks has begun.
LATE_S = 4.0
#: A computer that was busy until then has at least this long for the stop itself, s.
MIN_S = 0.5
#: A latch on a disk that stands still does not keep a stop waiting, s.
LATCH_S = 0.3
ENDS_WITHIN_S = 2.0

NOT_STOPPED = "NOT STOPPED"
SWITCH = "Use the stop switch of the bench"


def not_stopped_text(text: str) -> str:
    """Return what a person reads of a bench that is not known to stand."""
    return f"{NOT_STOPPED}: {text}. {SWITCH}."


@dataclass(frozen=True)
class StopResult:
    """What came of a stop."""

    bench: str
    stands: bool  #: whether it is confirmed that the table stands
    text: str
    campaign: int | None = None
    latched: bool = True  #: whether the stop was written into the latch


class StopAttempt:
    """One stop of one bench, in a thread of its own: by whatever still lives, until it is known whether it stands."""

    def __init__(self, place: BenchPlace, stop: StopRequest) -> None:
        """Begin at once. The latch is written first, but waited for only briefly."""
        self._place, self._stop = place, stop
        self._clock = SystemClock()
        self._heard, self._over = threading.Event(), threading.Event()
        self._result: StopResult | None = None
        self._latched = False
        self.text = "the stop is asked for"  #: how far it is, or what keeps it
        threading.Thread(target=self._work, name="stop-attempt", daemon=True).start()

    def is_heard(self, within_s: float) -> bool:
        """Wait until what drives the bench has left its step, or was ended; returns whether it has."""
        return self._heard.wait(within_s)

    def result(self, within_s: float | None = None) -> StopResult | None:
        """Wait for the end; returns what came of the stop, None while that is not known."""
        self._over.wait(within_s)
        return self._result

    def _work(self) -> None:
        latching = threading.Thread(target=self._latch, name="latch", daemon=True)
        latching.start()
        latching.join(LATCH_S)
        note = self._place.note() or DriverNote(self._place.name)
        try:
            result = self._stopped(note)
        except Exception as error:  # noqa: BLE001  it is the result, whatever it is
            result = StopResult(note.bench, False, str(error) or type(error).__name__)
        latching.join(LATCH_S)
        if result.stands:
            with contextlib.suppress(OSError):
                self._place.latch.at_rest([self._stop.id], result.text)
        self._result = StopResult(result.bench, result.stands, result.text, result.campaign, self._latched)
        self.text = result.text
        self._heard.set()
        self._over.set()

    def _latch(self) -> None:
        with contextlib.suppress(OSError):
            self._place.latch.request(self._stop)
            self._latched = True

    def _stopped(self, note: DriverNote) -> StopResult:
        for process, path, heard_within_s in (
            (note.driver, note.socket, HEARD_WITHIN_S),
            (note.guardian, note.guardian_socket, GUARDIAN_ANSWERS_S),
        ):
            if not process.lives or not path:
                continue
            if process.stands_still:
                self.text = f"process {process.pid} stands still and answers no stop"
                continue
            try:
                return self._by_process(note.bench, path, heard_within_s)
            except (OSError, ValueError, TypeError) as error:
                self.text = f"process {process.pid} did not answer the stop ({error})"
        if note.left and not note.driver.lives:
            return StopResult(note.bench, note.left_safe, note.left)
        if not note.document:
            return StopResult(
                note.bench, False, "no process drives it, and its instruments are not known; name the bench file: "
                "labctl stop --bench FILE",
            )  # fmt: skip
        return self._at_instruments(note)

    def _by_process(self, bench: str, path: str, heard_within_s: float) -> StopResult:
        """Stop through a process. Raises OSError where it does not answer, or does not reach what drives the bench."""
        begun_s, last = self._clock.now_s(), Word("asked")
        for last in ask(path, self._stop, SILENT_S, heard_within_s):
            self.text = last.text or self.text
            if last.phase == "heard":
                self._heard.set()
            waited_s = self._clock.now_s() - begun_s
            if not self._heard.is_set() and last.phase not in LAST and waited_s > heard_within_s:
                raise TimeoutError(f"no reaction within {heard_within_s:g} s")
            if waited_s > STANDS_WITHIN_S:
                break
        return StopResult(bench, last.phase == "stands", last.text, last.campaign)

    def _at_instruments(self, note: DriverNote) -> StopResult:
        self.text = f"{self.text}; labctl ends it and goes to the instruments"

        def say(text: str) -> None:
            self.text = text

        return at_instruments(note, say)


class AttemptedStop:
    """A stop attempt as a stop that is under way (`labctl.stop.wire.Stopping`)."""

    campaign: int | None = None

    def __init__(self, attempt: StopAttempt) -> None:
        self._attempt = attempt

    def is_heard(self, within_s: float) -> bool:
        """Wait until what drives the bench has left its step; returns whether it has."""
        return self._attempt.is_heard(within_s)

    def is_over(self, within_s: float) -> bool:
        """Wait until it is known whether the table stands; returns whether it is."""
        return self._attempt.result(within_s) is not None

    @property
    def stands(self) -> bool:
        """Whether the table is confirmed to stand."""
        result = self._attempt.result(0.0)
        return result is not None and result.stands

    @property
    def text(self) -> str:
        """How far the stop is, or what keeps it."""
        return self._attempt.text


def stop_bench(
    place: BenchPlace, stop: StopRequest, say: Callable[[str], None] = lambda _: None, begun_s: float = 0.0
) -> StopResult:
    """Stop a bench and wait until it stands, or it is known that it does not. Raises nothing.

    `say` gets one line if the bench is not known to stand after `LATE_S`, of which `begun_s` have passed already: on a
    busy computer a command needs seconds to begin.
    """
    attempt = StopAttempt(place, stop)
    if (result := attempt.result(max(LATE_S - begun_s, MIN_S))) is None:
        say(f"{NOT_STOPPED} yet: bench {place.name}: {attempt.text}. {SWITCH}.")
    result = result or attempt.result()
    assert result is not None
    return result


def at_instruments(note: DriverNote, say: Callable[[str], None]) -> StopResult:
    """End the process that drives a bench, and stop the bench through its drivers."""
    if trouble := end_process(note.driver):
        return StopResult(note.bench, False, trouble)
    if note.simulated:
        return StopResult(note.bench, True, "its simulated instruments ended with the process that drove them")
    from labctl.stop.instruments_stop import stop_instruments  # noqa: PLC0415  it loads the drivers' libraries

    left = stop_instruments(note.document, say)
    return StopResult(note.bench, left.stands, f"its instruments were stopped directly: {left.text}")


def end_process(process: ProcessId) -> str:
    """End a process at once, so that no other process drives its bench; returns what kept it, empty when it is gone."""
    if not process.lives:
        return ""
    try:
        handle = os.pidfd_open(process.pid)
    except ProcessLookupError:
        return ""
    except OSError as error:
        return f"process {process.pid} cannot be ended ({error.strerror})"
    try:
        if process.lives:  # the number is still that of this process, and the handle stays with it
            signal.pidfd_send_signal(handle, signal.SIGKILL)
        select.select([handle], [], [], ENDS_WITHIN_S)
    except ProcessLookupError:
        return ""
    except OSError as error:
        return f"process {process.pid} cannot be ended ({error.strerror})"
    finally:
        os.close(handle)
    return f"process {process.pid} does not end" if process.lives else ""

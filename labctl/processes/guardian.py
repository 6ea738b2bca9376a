"""The guardian of a bench: the supervisor's own way to the instruments, when the bench process does not stop them."""

from __future__ import annotations

import contextlib
import shutil
import tempfile
import threading
from collections.abc import Callable
from logging import ERROR, WARNING
from pathlib import Path

from instruments.bench_config import BenchFile
from labctl.log import get_logger
from labctl.stop.instruments_stop import InstrumentsLeft, stop_instruments
from labctl.stop.latch import StopRequest
from labctl.stop.places import BenchPlace
from labctl.stop.wire import StopServer

log = get_logger()


class GuardianStop:
    """The bench process ended, and its bench made safe, by the guardian."""

    campaign: int | None = None

    def __init__(self, guardian: Guardian, stop: StopRequest | None) -> None:
        self._over, self._at_rest = threading.Event(), threading.Event()
        self.safe = False  #: whether the whole safe state is confirmed
        self.text = "the supervisor ends the bench process and stops the bench"
        self._guardian, self._stop = guardian, stop
        threading.Thread(target=self._work, name="guardian", daemon=True).start()

    def _work(self) -> None:
        try:
            self._guardian.secure(self._stop, self._say, self._at_rest.set, self._end)
        finally:
            self._over.set()

    def _say(self, text: str) -> None:
        self.text = text

    def _end(self, stands: bool, text: str, *, safe: bool) -> None:
        self.text, self.safe = text, safe
        if stands:
            self._at_rest.set()

    def is_heard(self, within_s: float) -> bool:  # noqa: ARG002  the guardian has begun
        """Return True: no engine has to leave a step."""
        return True

    def is_over(self, within_s: float) -> bool:
        """Wait until the table stands, or the guardian has done what it can; returns whether either came."""
        return self._over.is_set() or self._at_rest.wait(within_s) or self._over.is_set()

    def wait(self, within_s: float) -> bool:
        """Wait until the guardian has done all that it can; returns whether it has."""
        return self._over.wait(within_s)

    @property
    def stands(self) -> bool:
        """Whether the table is confirmed to stand."""
        return self._at_rest.is_set()


class Guardian:
    """Ends the bench process and stops its bench: asked by `labctl stop`, a page, or the supervisor itself."""

    def __init__(self, bench: BenchFile, place: BenchPlace, end_process: Callable[[], str]) -> None:
        """Guard a bench; `end_process` ends the process that drives it now, and returns what kept it from ending."""
        self._bench, self._place, self._end_process = bench, place, end_process
        self._guard = threading.Lock()
        self._folder = Path(tempfile.mkdtemp(prefix="labctl-guardian-"))
        self.socket = self._folder / "stop"
        self._server = StopServer(self.socket, self.respond)
        self._server.start()

    @property
    def simulated(self) -> bool:
        """Whether the bench is simulated in the bench process, and ends with it."""
        return self._bench.is_simulated

    @property
    def busy(self) -> bool:
        """Whether the guardian has the instruments now, so that no other process may open them."""
        return self._guard.locked()

    def respond(self, stop: StopRequest) -> GuardianStop:
        """Begin a stop that the bench process did not carry out."""
        return GuardianStop(self, stop)

    def begin(self) -> GuardianStop:
        """Make safe a bench whose process ended, or does not answer."""
        return GuardianStop(self, None)

    def secure(
        self,
        stop: StopRequest | None,
        say: Callable[[str], None],
        stands: Callable[[], None],
        end: Callable[..., None],
    ) -> None:
        """End the bench process, then bring table and chamber to their safe state."""
        with self._guard:
            if stop is not None:
                with contextlib.suppress(OSError):
                    self._place.latch.request(stop)
            if trouble := self._end_process():
                end(False, trouble, safe=False)
                return
            if self._bench.is_simulated:
                left = InstrumentsLeft(stands=True, safe=True, text="its simulated instruments ended with it")
            else:
                left = stop_instruments(self._bench.model_dump(mode="json"), say, stands)
            log.log(
                WARNING if left.safe else ERROR, "guardian.stopped", bench=self._bench.name, stands=left.stands,
                text=left.text,
            )  # fmt: skip
            if left.stands and stop is not None:
                with contextlib.suppress(OSError):
                    self._place.latch.at_rest([stop.id], left.text)
            end(left.stands, f"labctl's supervisor has ended the bench process: {left.text}", safe=left.safe)

    def close(self) -> None:
        """Answer no further stop."""
        self._server.close()
        shutil.rmtree(self._folder, ignore_errors=True)

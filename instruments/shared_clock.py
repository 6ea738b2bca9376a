"""One scaled clock for several processes of this computer: a simulator, and those that drive its instruments.

The process that serves the simulated instruments owns the clock and counts its time in a small file, which the others
map into their memory. Threads on which the bench depends are registered with it: they read it every few milliseconds.
While one of them is late, because this computer does not run it, the clock stands still for all processes. A time-out,
a ramp or a stream so lasts as long, in the time of the bench, as on a computer that has nothing else to do.
"""

from __future__ import annotations

import fcntl
import math
import mmap
import os
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from instruments.bench_config import BenchFile
from instruments.clock import Clock, RealWall, ScaledClock, SystemClock, Wall
from instruments.logger import logger

log = logger(__name__)

#: The clock stands still while a registered thread is later than this: s of the clock, and at most s of real time.
#: The first is the latency of all links, and so below what makes a stream count as late.
LATE_CLOCK_S, LATE_S = 0.06, 0.012
#: A registered thread reads the clock this often in that time.
HEARTBEATS = 3
#: The process of a thread that is later than `DOUBTED_S` may have ended. From `GIVEN_UP_S` on no thread is waited for
#: that is halted, or waits for something else than this computer, and from `MAX_HELD_UP_S` on none at all.
DOUBTED_S, GIVEN_UP_S, MAX_HELD_UP_S = 0.25, 5.0, 120.0
#: States of a thread that this computer holds up: it waits for a processor, or for the kernel (proc(5)).
HELD_UP = ("R", "D")
#: Longest wait of a sleep until it reads the clock again, s of real time.
STEP_S = 0.05
#: Clock seconds that count as no time: rounding.
TINY_S = 1e-9

# The file: 64-bit values in the order of this computer. Real time is that of the monotonic clock, the same for all
# processes.
MAGIC, SPEED, UNTIL, COUNTED, END, FIRST_PLACE = range(6)  # END: where the places that were ever taken end
THREADS = 120  #: places for registered threads
# Of a place: 0 where it is free; the number by the system; when it read the clock.
PROCESS, THREAD, LAST_HEARTBEAT, PLACE = range(4)
SIZE = 8 * (FIRST_PLACE + PLACE * THREADS)
WRITTEN = int.from_bytes(b"labclk02", "big")
#: Tries to read a count that its owner is writing, which takes it about a microsecond.
TRIES = 1000


class ClockFile:
    """A mapped file. The owner of the clock alone writes the count, each thread its own place: no reader waits.

    `held_up` says of a thread, by the system's number, whether this computer holds it up.
    Raises OSError for a file that cannot be opened or is none of a clock.
    """

    def __init__(self, path: Path, held_up: Callable[[int], bool] | None = None) -> None:
        self.path = path
        self._held_up = held_up or is_held_up
        self._descriptor = os.open(path, os.O_RDWR | os.O_CLOEXEC)
        try:
            size = os.fstat(self._descriptor).st_size
            if size != SIZE:
                raise OSError(f"{path} has {size} bytes, but the file of a clock has {SIZE}")
            self._map = mmap.mmap(self._descriptor, SIZE)
        except BaseException:
            os.close(self._descriptor)
            raise
        self._times = memoryview(self._map).cast("d")
        self._numbers = memoryview(self._map).cast("q")
        if self._numbers[MAGIC] != WRITTEN:
            self.close()
            raise OSError(f"{path} is not the file of a clock of this release of labctl")

    @classmethod
    def made(cls, speed: float, now_s: float, held_up: Callable[[int], bool] | None = None) -> ClockFile:
        """Make the file of a clock that begins at real time `now_s`."""
        descriptor, name = tempfile.mkstemp(prefix="labctl-clock-")
        with os.fdopen(descriptor, "wb") as file:
            file.write(WRITTEN.to_bytes(8, sys.byteorder) + bytes(SIZE - 8))
        made = cls(Path(name), held_up)
        made._times[SPEED] = speed
        made.write_count(now_s, 0.0)
        return made

    @property
    def speed(self) -> float:
        """Clock seconds in one of real time while nothing is late."""
        return self._times[SPEED]

    @property
    def late_s(self) -> float:
        """How late a registered thread may be without the clock standing still, s of real time."""
        return min(LATE_S, LATE_CLOCK_S / self.speed)

    def count(self) -> tuple[float, float] | None:
        """Return until when time was counted, and how much, s of real time.

        None where the owner was halted while it wrote them.
        """
        for _ in range(TRIES):
            until_s, counted_s = self._times[UNTIL], self._times[COUNTED]
            if until_s == self._times[UNTIL]:
                return until_s, counted_s
        return None

    def write_count(self, until_s: float, counted_s: float) -> None:
        """Write both, for readers that may come in between."""
        self._times[UNTIL] = math.nan
        self._times[COUNTED] = counted_s
        self._times[UNTIL] = until_s

    def take_place(self, now_s: float) -> int:
        """Return a place for this thread, which is registered from `now_s` on; raises OSError where there is none."""
        fcntl.flock(self._descriptor, fcntl.LOCK_EX)
        try:
            for place in range(FIRST_PLACE, FIRST_PLACE + PLACE * THREADS, PLACE):
                if not self._numbers[place]:
                    self.heartbeat(place, now_s)
                    self._numbers[place + THREAD] = threading.get_native_id()
                    self._numbers[place + PROCESS] = os.getpid()
                    self._numbers[END] = max(self._numbers[END], place + PLACE)
                    return place
        finally:
            fcntl.flock(self._descriptor, fcntl.LOCK_UN)
        raise OSError(f"more than {THREADS} threads on the clock of one simulator; end a process that drives it")

    def leave_place(self, place: int) -> None:
        """Free the place of a thread."""
        self._numbers[place] = 0

    @property
    def registered(self) -> int:
        """How many threads are registered, of all processes."""
        return sum(bool(self._numbers[place]) for place in range(FIRST_PLACE, self._numbers[END], PLACE))

    def heartbeat(self, place: int, now_s: float) -> None:
        """Note that a thread read the clock at real time `now_s`."""
        self._times[place + LAST_HEARTBEAT] = now_s

    def horizon_s(self, now_s: float) -> tuple[float, bool]:
        """Return until when time may be counted, at most `now_s`: no registered thread is late by then.

        And whether a thread is no longer waited for: it may be that of the owner, which then counts nothing.
        """
        horizon_s, allowed_s, is_one_given_up = now_s, self.late_s, False
        for place in range(FIRST_PLACE, self._numbers[END], PLACE):
            if not (process := self._numbers[place]):
                continue
            heartbeat_s = self._times[place + LAST_HEARTBEAT]
            late_s = now_s - heartbeat_s
            if heartbeat_s + allowed_s >= horizon_s:
                continue
            if late_s > DOUBTED_S and not _lives(process):
                self.leave_place(place)
            elif self._is_waited_for(self._numbers[place + THREAD], late_s):
                horizon_s = heartbeat_s + allowed_s
            else:
                is_one_given_up = True
        return horizon_s, is_one_given_up

    def _is_waited_for(self, thread: int, late_s: float) -> bool:
        """Return whether the clock stands still for a thread that is so late."""
        return late_s <= GIVEN_UP_S or (late_s <= MAX_HELD_UP_S and self._held_up(thread))

    def close(self) -> None:
        """Close the file; safe to call twice."""
        if self._descriptor >= 0:
            self._times.release()
            self._numbers.release()
            self._map.close()
            os.close(self._descriptor)
            self._descriptor = -1


def is_held_up(thread: int) -> bool:
    """Return whether a thread, by the system's number, waits for a processor or for the kernel.

    One that is halted, that sleeps, that has ended, or of a system that does not tell, does not.
    """
    try:
        about = Path(f"/proc/{thread}/stat").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return False
    return about.rpartition(")")[2].split()[0] in HELD_UP


def _lives(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:  # another user's
        return True
    return True


class SharedClock(ScaledClock):
    """The clock of a simulator at more or less than real time, in its process and in those that drive it.

    Its time begins when it is made, in each process, and runs alike in all. Any thread may read it and sleep. A thread
    that is halted or sleeps for longer than `GIVEN_UP_S` is not waited for, nor is one whose process has ended. One
    that waits for a processor, or in the kernel for received bytes to be handed on, is waited for up to
    `MAX_HELD_UP_S`.
    """

    pauses_in_stalls = True

    def __init__(self, file: ClockFile, *, owns: bool = False, wall: Wall | None = None) -> None:
        super().__init__(file.speed)
        self.heartbeat_interval_s = file.late_s / HEARTBEATS
        self.latency_s = 2 * (self.heartbeat_interval_s + file.late_s) * file.speed
        self._file, self._owns, self._wall = file, owns, wall or RealWall()
        self._lock = threading.RLock()  # a signal handler may read the clock while its thread does
        self._never = threading.Condition()
        self._here = threading.local()  # its `place`: that of the present thread, where it is registered
        self._counted_s = 0.0  # s of real time; never less than was returned before
        self._read_s = -math.inf  # real time of the last reading
        self._zero_s = self._counted()

    @property
    def path(self) -> Path:
        """The file by which other processes share this clock."""
        return self._file.path

    def now_s(self) -> float:
        now_s = (self._counted() - self._zero_s) * self.speed
        if (place := self._place) is not None:
            self._file.heartbeat(place, self._wall.now_s())
        return now_s

    def sleep(self, duration_s: float) -> None:
        until_s = self.now_s() + duration_s
        step_s = STEP_S if self._place is None else self.heartbeat_interval_s
        while (left_s := until_s - self.now_s()) > TINY_S:
            with self._never:
                self._wall.wait(self._never, min(left_s / self.speed, step_s))

    @contextmanager
    def registered(self) -> Iterator[Callable[[], None]]:
        """Make the clock wait for this thread, which reads it, sleeps on it or calls its heartbeat all the time.

        Whatever else it does, it takes at most `late_s` of real time from the clock.
        """
        if self._place is not None:
            yield self._heartbeat
            return
        self._here.place = self._file.take_place(self._wall.now_s())
        try:
            yield self._heartbeat
        finally:
            self._file.leave_place(self._here.place)
            self._here.place = None

    @property
    def _place(self) -> int | None:
        """The place of this thread, where it is registered."""
        return getattr(self._here, "place", None)

    def _heartbeat(self) -> None:
        self.now_s()

    def _counted(self) -> float:
        """Return how much time was counted, s of real time; the owner writes it down."""
        with self._lock:
            now_s, count = self._wall.now_s(), self._file.count()
            if count is not None:
                until_s, counted_s = count
                horizon_s, is_one_given_up = self._file.horizon_s(now_s)
                if is_one_given_up and self._read_s > until_s:  # go on from here: until now the clock stood still
                    until_s, counted_s = self._read_s, self._counted_s
                counted_s += max(horizon_s - until_s, 0.0)
                if self._owns:
                    self._file.write_count(now_s, counted_s)
                self._counted_s, self._read_s = max(self._counted_s, counted_s), now_s
            return self._counted_s


@contextmanager
def served_clock(speed: float) -> Iterator[Clock]:
    """Yield the clock of simulated instruments that this process serves to others; at speed 1 it is this computer's.

    Raises OSError where its file cannot be made.
    """
    if speed == 1.0:
        yield SystemClock()
        return
    file = ClockFile.made(speed, RealWall().now_s())
    try:
        yield SharedClock(file, owns=True)
    finally:
        file.path.unlink(missing_ok=True)


def clock_outside(bench: BenchFile) -> Clock:
    """Return the clock of instruments outside this process: that of their simulator, or of this computer.

    Where the simulator does not share its clock, or has ended, a clock runs at its speed but on its own.
    """
    simulation = bench.simulation
    if simulation is None or simulation.control is None:
        return SystemClock()
    if simulation.clock is not None:
        try:
            return SharedClock(ClockFile(Path(simulation.clock)))
        except OSError as error:
            log.warning("clock.not_shared", extra={"file": simulation.clock, "reason": str(error)})
    return ScaledClock(simulation.speed)

"""Which processes the computer runs first: those of a stop, before pages, and pages before computations.

The values are niceness (setpriority(2)): lower runs first. Below zero they need a right (RLIMIT_NICE, CAP_SYS_NICE),
so each process also steps back from those before it where it has none. Linux groups processes by session when
`sched_autogroup_enabled` is set (sched(7)); niceness then acts inside a group only, and the group gets it as well where
the session is the process's own: that of a terminal holds other programs, which were raised too, and for good. A stop
that was typed at a terminal runs in real time instead, which no group holds back.

What drives or guards a bench also keeps its memory: where a system takes pages away that were not used for a while, and
its disk is busy, reading them again takes seconds in which a process does nothing, not even stop.

A stop loads this module before it runs first, so what it need not have is loaded where it is used.
"""

from __future__ import annotations

import contextlib
import os

#: What stops or guards a bench, what drives it, what answers requests where the others could not be raised.
STOP, BENCH, PAGES = -15, -10, 5
#: The lowest priority of real time, which is above every niceness (sched(7)).
REAL_TIME = 1
#: Of linux/mman.h: pages that there are, pages to come, and these when they are first used.
MCL_CURRENT, MCL_FUTURE, MCL_ONFAULT = 1, 2, 4


def first_of_all() -> None:
    """Run this process, which lives long, before all others, as far as the system allows it."""
    _set(STOP)


def at_once() -> None:
    """Run this process, which does one thing and ends, before all others; those that it starts run as any other."""
    try:
        os.sched_setscheduler(0, os.SCHED_RR | os.SCHED_RESET_ON_FORK, os.sched_param(REAL_TIME))
    except (OSError, AttributeError):
        first_of_all()


def of_the_bench() -> None:
    """Run this process, which drives or guards a bench, before those that answer requests, and keep its memory."""
    _set(BENCH)
    keep_memory()


def of_the_pages() -> None:
    """Give processes that drive a bench priority over this one.

    Where those could be raised, this one stays beside all others: a page is not to wait for every other program.
    """
    if _set(BENCH):
        _set(0)
    else:
        _set(PAGES)


def keep_memory() -> bool:
    """Keep every page of this process that is or will be in memory (mlockall(2)); returns whether the system does.

    Only where it may be as much as the process needs: beyond a limit (RLIMIT_MEMLOCK) it would get no more memory.
    """
    import ctypes  # noqa: PLC0415
    import resource  # noqa: PLC0415

    unlimited = resource.getrlimit(resource.RLIMIT_MEMLOCK)[0] == resource.RLIM_INFINITY
    if not (unlimited or os.geteuid() == 0):
        return False
    with contextlib.suppress(OSError, AttributeError):
        return bool(ctypes.CDLL(None).mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) == 0)
    return False


def _set(niceness: int) -> bool:
    """Set a niceness, zero where that needs a right that is missing; returns whether it could be set as it is."""
    for wanted in dict.fromkeys((niceness, max(niceness, 0))):
        try:
            os.setpriority(os.PRIO_PROCESS, 0, wanted)
        except OSError:
            continue
        with contextlib.suppress(OSError):
            if os.getsid(0) == os.getpid():
                _write("/proc/self/autogroup", str(wanted))
        return wanted == niceness
    return False


def _write(path: str, text: str) -> None:
    handle = os.open(path, os.O_WRONLY)
    try:
        os.write(handle, text.encode())
    finally:
        os.close(handle)

"""Which processes the computer runs first: those of a stop, before pages, and pages before computations.

The values are niceness (setpriority(2)): lower runs first. Below zero they need a right (RLIMIT_NICE, CAP_SYS_NICE),
so each process also steps back from those before it where it has none. Linux groups processes by session when
`sched_autogroup_enabled` is set (sched(7)); niceness then acts inside a group only, and the group gets it as well.
"""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

#: What stops or guards a bench, what drives it, what answers requests where the others could not be raised.
STOP, BENCH, PAGES = -15, -10, 5


def first_of_all() -> None:
    """Run this process before all others, as far as the system allows it."""
    _set(STOP)


def of_the_bench() -> None:
    """Run this process, which drives or guards a bench, before those that answer requests."""
    _set(BENCH)


def of_the_pages() -> None:
    """Let the processes that drive a bench go first.

    Where those could be raised, this one stays beside all others: a page is not to wait for every other program.
    """
    if _set(BENCH):
        _set(0)
    else:
        _set(PAGES)


def _set(niceness: int) -> bool:
    """Set a niceness, zero where that needs a right that is missing; returns whether it could be set as it is."""
    for wanted in dict.fromkeys((niceness, max(niceness, 0))):
        try:
            os.setpriority(os.PRIO_PROCESS, 0, wanted)
        except OSError:
            continue
        with contextlib.suppress(OSError):
            Path("/proc/self/autogroup").write_text(str(wanted), encoding="ascii")
        return wanted == niceness
    return False

"""Limits of a pool of computations: how many, how long, with how much memory."""

from __future__ import annotations

import os
from dataclasses import dataclass, field


def usable_cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@dataclass(frozen=True)
class Limits:
    """What a pool takes on, and what one computation may take."""

    at_once: int = field(default_factory=usable_cores)
    waiting: int = 8  #: more are refused
    #: Address space beside what is loaded already, MiB. The largest criticism takes some 500, the largest import that
    #: is allowed some 2,600.
    memory_mib: int = 4096
    deadline_s: float = 900.0  #: from the start of the work
    niceness: int = 10  #: above that of the service: the bench and pages come first

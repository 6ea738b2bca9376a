"""What a figure was measured on, and how to measure it: medians of several runs, peers side by side in one run."""

from __future__ import annotations

import os
import platform
import statistics
import sys
import time
from collections import defaultdict
from collections.abc import Callable
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path


def describe(*packages: str) -> dict[str, str]:
    """Return the machine and the versions of `packages`, to stand beside every figure."""
    info = Path("/proc/cpuinfo")
    model = (
        next(
            (line.split(":", 1)[1].strip() for line in info.read_text().splitlines() if line.startswith("model name")),
            platform.processor(),
        )
        if info.exists()
        else platform.processor()
    )
    memory_gib = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    return {
        "machine": f"{os.cpu_count()} cores, {model}, {memory_gib:.0f} GiB",
        "python": sys.version.split()[0],
        **{name: version(name) for name in packages},
    }


def processor_s(*processes: int) -> float:
    """Return the processor time that running processes, and all that they started, have taken so far, s."""
    own_s, children = {}, defaultdict(list)
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):  # it has ended
            fields = stat.read_text().rsplit(")", 1)[1].split()
            own_s[int(stat.parent.name)] = sum(map(int, fields[11:15])) / os.sysconf("SC_CLK_TCK")
            children[int(fields[1])].append(int(stat.parent.name))
    tree = list(processes)
    for process in tree:
        tree += children[process]
    return sum(own_s.get(process, 0.0) for process in tree)


def median_s(work: Callable[[], object], runs: int = 5) -> float:
    """Return the median wall time of `work` in seconds over `runs` runs, after one that does not count."""
    work()
    times = []
    for _ in range(runs):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return statistics.median(times)

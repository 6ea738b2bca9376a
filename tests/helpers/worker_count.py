"""How many processes run the tests: more than there are processors, because tests also wait."""

from __future__ import annotations

from pathlib import Path

#: Processes whose tests wait for a browser, another process or a serial line while the others compute. Each one more
#: imports and prepares all anew: on two processors six took longer than four.
WAITING = 2
#: Memory of one of these processes at its end, and of what it starts (a browser, a service, a database), bytes.
EACH_BYTES = 1_500_000_000


def worker_count(processors: int, available_bytes: int | None) -> int:
    """Return how many processes; fewer where the memory that is available, None where it is not known, is short."""
    wanted = processors + WAITING
    return wanted if available_bytes is None else max(1, min(wanted, available_bytes // EACH_BYTES))


def available_bytes(meminfo: Path = Path("/proc/meminfo")) -> int | None:
    """Return the memory that new processes can have without swapping, as Linux states it; None elsewhere."""
    try:
        lines = dict(line.split(":", 1) for line in meminfo.read_text(encoding="ascii").splitlines())
        return int(lines["MemAvailable"].split()[0]) * 1024
    except (OSError, KeyError):
        return None

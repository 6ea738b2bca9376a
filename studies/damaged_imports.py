"""Damaged logs and recordings sent to a running service: how each is answered, and what memory that takes.

After the files that were damaged at random come those of `studies.hostile_logs`, each once.

`LABCTL_STUDY_DAMAGED_LOGS` is how many files are sent, `LABCTL_STUDY_DAMAGED_SEED` which ones.
"""

from __future__ import annotations

import os
import tempfile
import threading
import time
from collections import Counter, defaultdict
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path

import httpx

from labctl.services.computation.limits import Limits
from studies.attack_kinds import Target
from studies.damaged_logs import KINDS, DamagedLog, damaged_logs, whole_logs
from studies.hostile_logs import hostile_logs

FILES = int(os.environ.get("LABCTL_STUDY_DAMAGED_LOGS", "300"))
SEED = int(os.environ.get("LABCTL_STUDY_DAMAGED_SEED", "2929"))
#: A worker may take this long and what waits before it as long again, s.
ANSWER_S = 900.0
POLL_INTERVAL_S = 0.1
#: What a recording or a refusal answers; anything else is a fault.
IMPORTED, REFUSED = frozenset({201}), frozenset({400, 409, 413, 422})


@dataclass
class Answers:
    """How the files of one kind were answered."""

    statuses: Counter[int] = field(default_factory=Counter)
    longest_s: float = 0.0


@dataclass
class Memory:
    """The most memory that processes of a service were seen to take, MiB, by what they are."""

    resident_mib: dict[str, float] = field(default_factory=dict)

    def look(self, target: Target) -> None:
        """Note what every process of a service takes now."""
        names = {pid: name for name, pid in target.pids.items()}
        for pid in _with_descendants({target.supervisor_pid}) - {target.supervisor_pid}:
            with suppress(OSError, ValueError, IndexError):
                name = names.get(pid) or _name_of(pid)
                status = Path(f"/proc/{pid}/status").read_text()
                mib = int(status.partition("VmHWM:")[2].split()[0]) / 1024
                self.resident_mib[name] = max(self.resident_mib.get(name, 0.0), mib)


def _name_of(pid: int) -> str:
    """Return what a process is that was started later: another web process, or a worker."""
    words = Path(f"/proc/{pid}/cmdline").read_bytes()
    return "web" if b"web_process" in words else "worker"


def _with_descendants(pids: set[int]) -> set[int]:
    parents: dict[int, int] = {}
    for each in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError, ValueError, IndexError):
            parents[int(each.parent.name)] = int(each.read_text().rpartition(")")[2].split()[1])
    found = set(pids)
    while more := {pid for pid, parent in parents.items() if parent in found} - found:
        found |= more
    return found


def _send(target: Target, log: DamagedLog, answers: Answers, faults: list[str]) -> None:
    begun_s = time.monotonic()
    try:
        answer = target.http.post(log.path, **log.parts, timeout=ANSWER_S)
        status, text = answer.status_code, answer.text
    except httpx.TransportError as error:
        status, text = 0, repr(error)
    answers.longest_s = max(answers.longest_s, time.monotonic() - begun_s)
    answers.statuses[status] += 1
    unnamed = status == 400 and not any(name in text for name in (log.name, *log.beside, "column_map", "map"))
    if status not in IMPORTED | REFUSED or unnamed:
        faults.append(f"{log.kind} ({log.damage}): {status} {text[:300]}")
        print(f"   {faults[-1]}", flush=True)


def run(files: int = FILES, seed: int = SEED) -> str:
    """Send damaged files to a service of its own, and return how they were answered."""
    with tempfile.TemporaryDirectory() as folder:
        target = Target(Path(folder))
        try:
            return _measured(target, Path(folder), files, seed)
        finally:
            target.close()


def _measured(target: Target, folder: Path, files: int, seed: int) -> str:
    found: defaultdict[str, Answers] = defaultdict(Answers)
    memory, over, faults = Memory(), threading.Event(), list[str]()

    def watch() -> None:
        while not over.wait(POLL_INTERVAL_S):
            memory.look(target)

    watching = threading.Thread(target=watch, daemon=True)
    watching.start()
    logs = chain(damaged_logs(whole_logs(folder), -(-files // len(KINDS)), seed), hostile_logs(folder))
    with ThreadPoolExecutor(Limits().at_once) as senders:  # as many at once as the service computes
        list(senders.map(lambda log: _send(target, log, found[log.kind], faults), logs))
    over.set()
    watching.join()
    alive = [name for name, pid in target.pids.items() if Path(f"/proc/{pid}").exists()]
    lines = ["kind                              files  imported  refused  other  longest_s"]
    lines += [_line(kind, answers) for kind, answers in found.items()]
    statuses = sum((answers.statuses for answers in found.values()), Counter[int]())
    lines.append(f"{statuses.total()} files by status: {dict(sorted(statuses.items()))}")
    lines.append(f"{len(faults)} faults (no recording, and no refusal that names the file)")
    limit = Limits().memory_mib
    taken = ", ".join(f"{name} {mib:.0f} MiB" for name, mib in sorted(memory.resident_mib.items()))
    lines.append(f"largest memory: {taken} (limit of a worker: {limit} MiB); never restarted: {', '.join(alive)}")
    return "\n".join(lines)


def _line(kind: str, answers: Answers) -> str:
    statuses = answers.statuses
    imported = sum(count for status, count in statuses.items() if status in IMPORTED)
    refused = sum(count for status, count in statuses.items() if status in REFUSED)
    other = statuses.total() - imported - refused
    return f"{kind:34}{statuses.total():5}{imported:10}{refused:9}{other:7}{answers.longest_s:11.2f}"

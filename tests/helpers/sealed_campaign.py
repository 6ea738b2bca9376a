"""A simulated campaign that can open no file once its bench is open; for a process of its own.

Writes one JSON document: how the campaign ended, and which modules were imported after its bench was opened.
"""

from __future__ import annotations

import contextlib
import json
import os
import resource
import sys
from collections.abc import Iterator
from pathlib import Path

from instruments.clock import VirtualClock
from labctl.answers.campaigns import ResumeRequest
from labctl.services.campaigns.execution import run
from labctl.services.campaigns.preparation import prepare
from labctl.services.campaigns.resume import prepare_resume
from labctl.services.planning.loading import load_bench
from labctl.store import ResumePoint, open_store
from procedures.contracts.control import Control
from procedures.monitoring.progress import Progress


@contextlib.contextmanager
def no_file_left() -> Iterator[None]:
    """Keep this process from opening anything while the block runs."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    highest = max(int(path.name) for path in Path("/proc/self/fd").iterdir())
    resource.setrlimit(resource.RLIMIT_NOFILE, (highest + 1, hard))
    taken: list[int] = []
    with contextlib.suppress(OSError):
        while True:
            taken.append(os.dup(0))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
        for number in taken:
            os.close(number)


def clock_of(standing: ResumePoint) -> VirtualClock:
    """Return virtual time that goes on where a campaign was left."""
    return VirtualClock(standing.last_at)


def main(database: str, bench_name: str, recipe: str, how: str) -> None:
    """Run a campaign to its end, or abort it and, where it is `resumed`, resume it."""
    bench = load_bench(bench_name)
    with open_store(database, write=True) as store:
        prepared, control = prepare(store, recipe, bench, VirtualClock(), clip=True), Control()
        if how == "resumed":
            control.abort("enough")
            run(store, prepared, control)
            prepared = prepare_resume(store, prepared.id, bench, clock_of, ResumeRequest(by="a test"))
            control = Control()
        before = set(sys.modules)

        with contextlib.ExitStack() as stack:
            if how != "resumed":
                stack.enter_context(no_file_left())

            def observe(progress: Progress) -> None:
                nonlocal sealed
                if not sealed and progress.step is not None:  # a link that was lost is opened again before
                    sealed = True
                    stack.enter_context(no_file_left())
                if how == "aborted" and (progress.step or 0) > progress.steps / 2:
                    control.abort("enough")

            sealed = how != "resumed"
            answer = run(store, prepared, control, observe)
        late = sorted(set(sys.modules) - before)
        sys.stdout.write(json.dumps({"state": answer.state, "reason": answer.reason, "late": late}))


if __name__ == "__main__":
    main(*sys.argv[1:])

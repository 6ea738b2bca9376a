"""Which file of tests a worker of pytest-xdist takes next: some workers wait while others compute."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from xdist.scheduler import LoadFileScheduling

if TYPE_CHECKING:
    from xdist.workermanage import WorkerController

#: Tests that mostly wait: for a process, a serial line.
WAITING = ("tests/system/", "tests/test_docs_", "tests/instruments/interoperation/")
#: Tests before a browser: they wait for it, and it computes.
PAGES = ("tests/web/",)
#: Of so many workers, so many take files of each kind, as long as there are files of it.
SHARES = {"waiting": 2, "pages": 1, "computing": 1}
#: Files that take longest, 10 to 130 s each: early, so that none is left alone at the end.
LONG = (
    "tests/test_docs_blocks", "tests/system/test_stop_path", "tests/system/test_service_process",
    "tests/instruments/interoperation/test_foreign_bench", "tests/system/test_connection_attacks",
    "tests/system/test_frozen_postgresql", "tests/system/test_two_processes", "tests/labctl/corpus/",
    "tests/labctl/api/test_openapi", "tests/labctl/fitting/criticism/", "tests/blind/",
    "tests/labctl/services/campaigns/test_resume", "tests/labctl/services/criticism/test_next_experiment",
    "tests/labctl/services/certificates/test_verified_conformity", "tests/labctl/services/test_certification",
)  # fmt: skip


def kind_of(name: str) -> str:
    """Return the kind of a file of tests."""
    return "waiting" if name.startswith(WAITING) else "pages" if name.startswith(PAGES) else "computing"


def place_of(name: str) -> int:
    """Return the place of a file among those that are taken early; all others have the last."""
    return next((place for place, start in enumerate(LONG) if name.startswith(start)), len(LONG))


def next_file(left: Iterable[str], others: Sequence[str]) -> str:
    """Return the first file of the kind that too few workers are at, by its share.

    `left` are the files that no worker has taken, `others` the kinds that the other workers are at.
    """
    first: dict[str, str] = {}
    for name in left:
        first.setdefault(kind_of(name), name)
    return first[min(first, key=lambda kind: (others.count(kind) + 1) / SHARES[kind])]


class MixedScheduling(LoadFileScheduling):
    """Gives each worker that is free the next file."""

    def __init__(self, *given: Any) -> None:
        super().__init__(*given)
        self._at: dict[WorkerController, str] = {}
        self._places: dict[str, int] = {}

    def _assign_work_unit(self, node: WorkerController) -> None:
        name = next_file(self.workqueue, [kind for other, kind in self._at.items() if other is not node])
        unit = self.workqueue.pop(name)
        self._at[node] = kind_of(name)
        self.assigned_work[node][name] = unit
        if not self._places:  # the same in all workers
            self._places = {test: place for place, test in enumerate(self.registered_collections[node])}
        node.send_runtest_some([self._places[test] for test, is_done in unit.items() if not is_done])

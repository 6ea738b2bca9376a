"""The files of tests that the workers take: of each kind so many at a time, while there are files of it."""

from __future__ import annotations

from tests.helpers.mixed_scheduling import LONG, SHARES, kind_of, next_file, place_of
from tests.helpers.paths import ROOT

FILES = {
    "waiting": ["tests/system/test_stop_path.py", "tests/system/test_wheel.py", "tests/test_docs_blocks.py"],
    "pages": ["tests/web/test_bench.py", "tests/web/test_tour.py"],
    "computing": ["tests/labctl/test_core.py", "tests/blind/test_hidden.py", "tests/test_docs.py"],
}


def taken(left: list[str], workers: int) -> list[str]:
    """Return the kinds of the files that so many workers take first."""
    at: list[str] = []
    for _ in range(workers):
        left.remove(name := next_file(left, at))
        at.append(kind_of(name))
    return sorted(at)


def test_the_workers_take_files_of_each_kind_by_its_share() -> None:
    shared = sorted(kind for kind, share in SHARES.items() for _ in range(share))
    assert taken([name for names in FILES.values() for name in names], sum(SHARES.values())) == shared


def test_where_no_file_of_a_kind_is_left_another_is_taken() -> None:
    assert taken([*FILES["pages"], *FILES["computing"]], 4) == ["computing", "computing", "pages", "pages"]


def test_the_files_that_take_longest_are_there_and_come_first() -> None:
    assert [start for start in LONG if not list(ROOT.glob(f"{start}*"))] == []
    assert min(map(place_of, FILES["waiting"])) < place_of("tests/system/test_wheel.py") == len(LONG)

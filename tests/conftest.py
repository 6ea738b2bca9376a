"""For all tests: small matrices are solved fastest by one thread, and two workers must not fight for two cores."""

import asyncio
import contextlib
import gc
import itertools
import os
import shutil
import sys
import tempfile
from collections.abc import Callable, Coroutine, Generator, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

from tests.helpers import memory_folder
from tests.helpers.built_command import build_once
from tests.helpers.cortex_m import INSTALL_CORTEX_M, has_cortex_m
from tests.helpers.leftovers import leftover_tasks, leftover_threads
from tests.helpers.signal_defaults import default_signals
from tests.helpers.worker_count import available_bytes, worker_count

#: The same examples every time and on every machine; a busy machine is slow, not wrong.
settings.register_profile("labctl", derandomize=True, deadline=None, database=None)
settings.load_profile("labctl")
pytest_plugins = ["tests.helpers.postgresql"]
#: How long a coroutine of a test may take, seconds.
LOOP_S = 60.0
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
#: In memory, for this process and its workers; before anything asks where temporary files go.
IN_MEMORY = memory_folder.enter()
# `labctl stop` finds benches by what is kept here: those of the tests are no benches of the user.
os.environ["XDG_STATE_HOME"] = str(Path(tempfile.gettempdir()) / f"tests-of-labctl-state-{os.getuid()}-{os.getpid()}")
build_once()
# The processes that tests start would each compile all modules again.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False


@pytest.fixture(scope="session")
def run_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of this run, the same in all of its workers."""
    own = tmp_path_factory.getbasetemp()
    return own.parent if "PYTEST_XDIST_WORKER" in os.environ else own


def kept_in(run_folder: Path) -> Path:
    """Make the cache of the run, for what its tests need and do not test; returns its folder."""
    kept = run_folder / "answers"
    for place in (run_folder / "walks", kept / "labctl"):
        place.mkdir(mode=0o700, parents=True, exist_ok=True)
    with contextlib.suppress(FileExistsError):
        (kept / "labctl" / "walks").symlink_to(run_folder / "walks", target_is_directory=True)
    return kept


@pytest.fixture(scope="session", autouse=True)
def cache_of_fixtures(run_folder: Path) -> Iterator[None]:
    """Keep what fixtures of a module or a session compute, which begin before a test has its own cache."""
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("XDG_CACHE_HOME", str(kept_in(run_folder)))
        yield


@pytest.fixture(scope="session")
def next_cache(tmp_path_factory: pytest.TempPathFactory) -> Callable[[], Path]:
    """Return what makes another folder. `mktemp` would list all that are there to find the next number."""
    caches, numbers = tmp_path_factory.mktemp("caches"), itertools.count()
    return lambda: caches / str(next(numbers))


@pytest.fixture(autouse=True)
def cache(run_folder: Path, next_cache: Callable[[], Path], monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Each test its own kept answers: nothing is taken from the user's cache, and nothing goes there.

    Walks through plans are kept for all tests: their files are named by all that they depend on.
    """
    folder, walks = next_cache(), run_folder / "walks"
    for place in (walks, folder / "labctl"):
        place.mkdir(mode=0o700, parents=True, exist_ok=True)
    (folder / "labctl" / "walks").symlink_to(walks, target_is_directory=True)
    monkeypatch.setenv("XDG_CACHE_HOME", str(folder))
    yield folder
    shutil.rmtree(folder)


@pytest.fixture
def shared_answers(cache: Path, run_folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Take kept answers from a cache of the run: the same criticism is worked out once, as it is for a person."""
    kept = kept_in(run_folder)
    monkeypatch.setenv("XDG_CACHE_HOME", str(kept))
    return kept


@pytest.fixture(autouse=True)
def signals() -> Iterator[None]:
    """Let each test begin with the default handlers; those that it leaves behind go."""
    with default_signals():
        yield


@pytest.fixture(autouse=True)
def nothing_left(signals: None) -> Iterator[None]:
    """Fail a test that leaves a thread or an asyncio task of its own behind. Set up first, so checked last."""
    with leftover_threads() as threads, leftover_tasks() as tasks:
        yield
    assert not threads, f"threads that run on: {threads}"
    assert not tasks, f"tasks that were cancelled with their loop: {tasks}"


@pytest.fixture
def in_a_loop() -> Callable[[Coroutine[Any, Any, Any]], Any]:
    """Run a coroutine to its end in a thread of its own: a browser of other tests keeps a loop in this one.

    It has an end of its own too: the time-out of a test interrupts the main thread, which then waits for this one.
    """

    def run(work: Coroutine[Any, Any, Any]) -> Any:
        with ThreadPoolExecutor(1) as thread:
            return thread.submit(asyncio.run, asyncio.wait_for(work, LOOP_S)).result()

    return run


#: Tests that mostly wait: for a browser, a process, a serial line.
WAITING = ("tests/system/", "tests/web/", "tests/test_docs_")
#: Tests that compute for longest, 10 to 60 s of processor time a file: early, so that none is left alone at the end.
LONG = (
    "tests/labctl/corpus/", "tests/labctl/fitting/criticism/", "tests/labctl/services/campaigns/test_resume",
    "tests/labctl/services/criticism/test_next_experiment", "tests/blind/", "tests/labctl/api/test_openapi",
    "tests/labctl/plots/test_truth", "tests/labctl/recording/test_verification", "tests/labctl/cli/test_diagnose",
)  # fmt: skip
#: So many files of other tests come between two that wait: these then wait while the other workers compute. With them
#: all at the begin, all workers waited at once; the last one comes well before the end.
BETWEEN = 8


def in_order(names: Iterable[str]) -> list[str]:
    """Return the files of tests in the order in which workers take them."""
    waiting = [name for name in names if name.startswith(WAITING)]
    others = sorted(
        (name for name in names if not name.startswith(WAITING)), key=lambda name: not name.startswith(LONG)
    )
    order = []
    for number, name in enumerate(waiting):
        order += [name, *others[BETWEEN * number : BETWEEN * (number + 1)]]
    return [*order, *others[BETWEEN * len(waiting) :]]


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Have the tests that wait beside those that compute; leave out what this machine cannot do, and say so."""
    files = dict.fromkeys(item.nodeid.partition("::")[0] for item in items)
    place = {name: number for number, name in enumerate(in_order(files))}
    items.sort(key=lambda item: place[item.nodeid.partition("::")[0]])
    for marker, is_there, reason in (
        ("needs_cc", shutil.which("cc") is not None, "no C compiler (on Debian: apt-get install gcc libc6-dev)"),
        ("needs_cortex_m", has_cortex_m(), f"no compiler and emulator for ARM ({INSTALL_CORTEX_M})"),
    ):
        for item in items if not is_there else ():
            if item.get_closest_marker(marker):
                item.add_marker(pytest.mark.skip(reason=reason))


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """Return what `-n auto` is here."""
    from labctl.services.computation.limits import usable_cores  # the workers, which need it not, begin sooner

    return worker_count(usable_cores(), available_bytes())


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Search for no garbage while the tests are collected: nearly all that is made then stays, a fifth of the time."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()


def pytest_collection_finish() -> None:
    """Leave the tests and the modules to no later search for garbage, and search less often than Python would.

    Each search would walk through a million objects; the tests themselves make few that refer to each other.
    """
    gc.collect()
    gc.freeze()
    gc.set_threshold(20_000, 20, 20)


def pytest_sessionfinish(exitstatus: int) -> None:
    """Give the memory back, unless a test failed: then the next run does."""
    gc.freeze()  # the end of this process looks through none of it
    if IN_MEMORY is not None and exitstatus == pytest.ExitCode.OK:
        shutil.rmtree(IN_MEMORY, ignore_errors=True)

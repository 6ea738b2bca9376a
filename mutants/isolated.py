"""Runs tests against one mutant after the other, in a copy of the repository.

Each run is a process of its own that begins with the libraries loaded, so that it takes seconds less. The mutant is
written to the disk of the copy, so that processes which a test starts have it too.
"""

from __future__ import annotations

import contextlib
import importlib
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import grimp
import pytest

PACKAGES = ("instruments", "procedures", "labctl")
#: What a mutant may take, of the time that the module itself takes, and besides, s: it may never end.
TIMES, BESIDES_S = 4.0, 20.0
LONGEST_S = 600.0
PASSED, FAILED, NOTHING_COLLECTED = 0, 1, 5
#: What each run loads itself: the tests, and what a mutant could change.
NOT_LOADED = frozenset({"tests", "conftest", "mutants", "__main__", "sitecustomize"})
#: The first failure is enough. What is loaded already cannot be rewritten, and need not be.
OPTIONS = (
    "-x", "-p", "pytest_timeout", "-p", "no:cacheprovider", "--tb=line",
    "-W", "ignore::pytest.PytestAssertRewriteWarning",
)  # fmt: skip


@dataclass(frozen=True)
class Outcome:
    """How the tests ended."""

    status: int  #: of pytest; negative where the time was over
    took_s: float
    output: str

    @property
    def survived(self) -> bool:
        """Whether no test noticed."""
        return self.status == PASSED


@contextlib.contextmanager
def copy_of(root: Path) -> Iterator[Path]:
    """Return a copy of what the repository at `root` has, until the end of the block."""
    parent = Path("/dev/shm") if Path("/dev/shm").is_dir() else None
    copy = Path(tempfile.mkdtemp(prefix="labctl-mutants-", dir=parent))
    try:
        names = subprocess.run(
            ["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z"],
            cwd=root, check=True, capture_output=True,
        ).stdout.decode()  # fmt: skip
        for name in filter(None, names.split("\0")):
            source, place = root / name, copy / name
            if source.is_symlink() or source.is_file():
                place.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(source, place, follow_symlinks=False)
        yield copy
    finally:
        shutil.rmtree(copy, ignore_errors=True)


class Runner:
    """Runs tests in a copy of the repository, each time with another content of one module."""

    def __init__(self, root: Path, copy: Path) -> None:
        self._copy, self._loaded = copy, copy / ".loaded"
        self._written = int(time.time())
        self._importers = grimp.build_graph(*PACKAGES)
        os.environ["PYTEST_DISABLE_PLUGIN_AUTOLOAD"] = "1"
        os.environ["PYTHONPATH"] = str(copy)
        os.chdir(copy)
        sys.path[:] = [str(copy), *(each for each in sys.path if each not in {"", str(root)})]

    def load_for(self, module: str, tests: Sequence[str]) -> Outcome:
        """Run the tests with a module as it is, and load what they need and no change of the module changes.

        Every later run begins with these loaded, which saves most of its time.
        """
        code = (self._copy / module).read_text(encoding="utf-8")
        outcome = self.run(module, code, tests, LONGEST_S)
        loaded = self._loaded.read_text(encoding="utf-8").split()
        own = module.removesuffix(".py").replace("/", ".").removesuffix(".__init__")
        changed = self._all_importers(own)
        for name in [each for each in sys.modules if each.split(".")[0] in PACKAGES]:
            del sys.modules[name]
        for name in loaded:
            package = name.split(".")[0]
            if package in NOT_LOADED or name in changed or name in sys.modules:
                continue
            with contextlib.suppress(Exception), warnings.catch_warnings(action="ignore"):
                importlib.import_module(name)
        if own in sys.modules:
            raise RuntimeError(f"{own} was loaded before its mutants by a module that is not known to import it")
        return outcome

    def _all_importers(self, module: str) -> set[str]:
        """Return a module and what imports it, also through a package that loads its modules when they are needed."""
        found, left = set[str](), {module}
        while left:
            found |= left
            packages = {each.rpartition(".")[0] for each in left} - {"", *PACKAGES}
            left = {each for name in left for each in self._importers.find_modules_that_directly_import(name)}
            left = (left | packages) - found
        return found

    def run(self, module: str, code: str, tests: Sequence[str], limit_s: float) -> Outcome:
        """Return how the tests end with `code` in the place of a module, which is as before afterwards."""
        place = self._copy / module
        original = place.read_text(encoding="utf-8")
        try:
            self._write(place, code)
            return self._tested(tests, limit_s)
        finally:
            self._write(place, original)

    def _write(self, place: Path, code: str) -> None:
        """Write a module at a time of its own: Python takes a compiled file for that of a source of the same second."""
        place.write_text(code, encoding="utf-8")
        self._written += 1
        os.utime(place, (self._written, self._written))

    def _tested(self, tests: Sequence[str], limit_s: float) -> Outcome:
        began_s = time.monotonic()
        with tempfile.TemporaryFile() as output:
            pid = os.fork()
            if pid == 0:
                _become_a_test(self._loaded, output.fileno(), tests, limit_s)
            try:
                status = _ended(pid, began_s + limit_s)
            finally:
                with contextlib.suppress(ProcessLookupError):
                    os.killpg(pid, signal.SIGKILL)  # what a test left behind, or the test where this process is ended
            output.seek(0)
            text = output.read().decode(errors="replace")
        return Outcome(status, time.monotonic() - began_s, text)


def _become_a_test(loaded: Path, output: int, tests: Sequence[str], limit_s: float) -> None:
    """Run pytest in this forked process, note which modules it has loaded, and end with pytest's status."""
    status = FAILED
    try:
        os.setsid()
        os.dup2(output, 1)
        os.dup2(output, 2)
        resource.setrlimit(resource.RLIMIT_CPU, (int(limit_s) + 1, int(limit_s) + 5))
        status = int(pytest.main([*OPTIONS, *tests]))
        loaded.write_text("\n".join(list(sys.modules)), encoding="utf-8")
    except BaseException:  # noqa: BLE001  the process ends here, whatever happened
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)


def _ended(pid: int, until_s: float) -> int:
    """Return the status of a process once it has ended, that of a signal negative; kill it when its time is over."""
    while True:
        ended, status = os.waitpid(pid, os.WNOHANG)
        if ended:
            return os.waitstatus_to_exitcode(status)
        if time.monotonic() > until_s:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(pid, signal.SIGKILL)
            os.waitpid(pid, 0)
            return -int(signal.SIGKILL)
        time.sleep(0.02)

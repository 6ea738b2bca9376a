"""Rules of the house that no linter knows."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

from tests.helpers.paths import ROOT

SOURCES = sorted(
    path
    for folder in ("instruments", "procedures", "labctl", "tests", "benchmarks", "examples", "studies")
    for path in (ROOT / folder).rglob("*.py")
)
RUNTIME = [path for path in SOURCES if path.relative_to(ROOT).parts[0] in {"instruments", "procedures", "labctl"}]


def name(path: Path) -> str:
    return str(path.relative_to(ROOT))


def test_there_is_something_to_check() -> None:
    assert len(RUNTIME) > 30


@pytest.mark.parametrize("path", SOURCES, ids=name)
def test_no_file_passes_400_lines(path: Path) -> None:
    lines = len(path.read_text(encoding="utf-8").splitlines())
    assert lines <= 400, f"{name(path)} has {lines} lines; split it by reason to change"


# A migration is a frozen list of tables: data, not a function to read.
@pytest.mark.parametrize("path", [path for path in RUNTIME if "versions" not in path.parts], ids=name)
def test_no_function_passes_70_lines(path: Path) -> None:
    long = [
        f"{name(path)}:{node.lineno} {node.name}"
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
        and (node.end_lineno or node.lineno) - node.lineno >= 70
    ]
    assert not long, f"a function fits on a screen: {long}"


REAL_TIME = re.compile(
    r"\btime\.(sleep|time|monotonic|perf_counter)\(|\bdatetime\.(now|utcnow|today)\(|asyncio\.sleep\("
)


@pytest.mark.parametrize("path", RUNTIME, ids=name)
def test_only_the_clock_reads_the_time(path: Path) -> None:
    if name(path) == "instruments/clock.py":
        return
    found = REAL_TIME.findall(path.read_text(encoding="utf-8"))
    assert not found, f"{name(path)} reads the time itself; take a Clock"


@pytest.mark.parametrize("path", RUNTIME, ids=name)
def test_every_module_says_what_it_is_for(path: Path) -> None:
    assert ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))), f"{name(path)} has no docstring"


def test_lock_files_carry_hashes_and_no_address() -> None:
    for path in (ROOT / "requirements").glob("*.txt"):
        text = path.read_text(encoding="utf-8")
        assert "--hash=sha256:" in text
        assert "://" not in text, f"{name(path)} names a registry"

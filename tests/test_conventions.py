"""Rules of this project that no linter knows. Each test lists what offends."""

from __future__ import annotations

import ast
import re
from collections import Counter

import pytest

from tests.helpers.paths import ROOT
from tests.helpers.source_files import SourceFile, circles, import_graph, sources

RUNTIME = tuple(file for file in sources() if file.is_runtime)
TESTS = tuple(file for file in sources() if file.parts[0] == "tests")
MAX_LINES, MAX_LINES_OF_A_TEST, MAX_LINES_OF_A_FUNCTION = 400, 400, 50


def lines(what_to_do: str, found: list[str]) -> str:
    return "\n  ".join([what_to_do, *found])


def test_there_are_files_to_check() -> None:
    assert len(RUNTIME) > 200
    assert len(TESTS) > 50


def test_no_file_is_longer_than_a_reader_holds_in_mind() -> None:
    length = {file: len(file.text.splitlines()) for file in sources()}
    long = [
        f"{file.name}: {count} lines"
        for file, count in length.items()
        if count > (MAX_LINES if file.is_runtime else MAX_LINES_OF_A_TEST)
    ]
    assert not long, lines("split it by reason to change", long)


def test_every_function_fits_on_a_screen() -> None:
    long = [
        f"{file.name}:{node.lineno} {node.name}: {node.end_lineno - node.lineno + 1} lines"
        for file in RUNTIME
        if "versions" not in file.parts  # a migration is a frozen list of tables
        for node in file.functions
        if node.end_lineno is not None and node.end_lineno - node.lineno >= MAX_LINES_OF_A_FUNCTION
    ]
    assert not long, lines("split it", long)


def test_every_module_says_what_it_is_for() -> None:
    silent = [file.name for file in sources() if file.text.strip() and not ast.get_docstring(file.tree)]
    assert not silent, lines("without a docstring", silent)


READS_THE_TIME = re.compile(
    r"\btime\.(sleep|time|monotonic|perf_counter)\(|\bdatetime\.(now|utcnow|today)\(|asyncio\.sleep\("
)


def test_only_the_clock_reads_the_time() -> None:
    found = [file.name for file in RUNTIME if READS_THE_TIME.search(file.text)]
    assert found == ["instruments/clock.py"], "take a Clock"


REALLY_SLEEPS = re.compile(r"\btime\.sleep\(|asyncio\.sleep\((?!0\))|(System|Wall)Clock\(\)\.sleep\(")


def test_no_test_sleeps() -> None:
    found = [
        file.name for file in TESTS if file.name != "tests/test_conventions.py" and REALLY_SLEEPS.search(file.text)
    ]
    assert not found, "wait for an event: a line, a file, a signal, a change of state"


def test_no_modules_import_each_other_in_a_circle() -> None:
    packages = {file.module for file in RUNTIME if file.path.name == "__init__.py"}
    # a package that names what its modules offer is imported by them as a folder, not as a file
    found = [" ".join(each) for each in circles(import_graph(RUNTIME)) if len(set(each) - packages) > 1]
    assert not found, lines("take apart", found)


@pytest.mark.parametrize(
    ("graph", "expected"),
    [
        ({"a": {"b"}, "b": {"c"}, "c": set()}, []),
        ({"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"a"}}, [["a", "b", "c"]]),
    ],
)
def test_a_circle_is_seen(graph: dict[str, set[str]], expected: list[list[str]]) -> None:
    assert circles(graph) == expected


#: File names that were private words: each has a term of its field now.
PRIVATE_NAMES = frozenset(
    {
        "acts", "asking", "attendant", "beginnings", "crew", "door", "glances", "hand", "heart", "house", "judging",
        "keeping", "kept", "kinds", "looking", "mend", "moments", "opening", "past", "plain", "reading", "room",
        "rooms", "seal", "shelf", "shield", "situation", "stage", "takeup", "voice", "weigh", "wires",
    }
)  # fmt: skip


def test_files_have_the_names_of_their_field() -> None:
    found = [file.name for file in sources() if file.path.stem.removeprefix("test_") in PRIVATE_NAMES]
    assert not found, lines("rename", found)


def test_tests_take_what_they_share_from_helpers() -> None:
    """A test module or a conftest is not imported by others: what two of them need is in tests/helpers."""
    offenders = [
        f"{file.name}: {name}"
        for file in sources()
        for name in file.imports
        if name.split(".")[0] in {"tests", "conftest"} and not name.startswith("tests.helpers.")
    ]
    assert not offenders, lines("move it to tests/helpers", offenders)


def test_lock_files_carry_hashes_and_no_address() -> None:
    texts = {path.name: path.read_text(encoding="utf-8") for path in (ROOT / "requirements").glob("*.txt")}
    assert texts
    assert not [name for name, text in texts.items() if "--hash=sha256:" not in text or "://" in text]


ASSERTING = frozenset({"raises", "warns", "deprecated_call", "fail"})


def asserts(node: ast.AST, helpers: frozenset[str] = frozenset()) -> bool:
    """Return whether something in `node` can fail: an assert, pytest.raises, or a call of a helper that asserts."""
    return any(
        isinstance(part, ast.Assert) or (isinstance(part, ast.Call) and called(part) in ASSERTING | helpers)
        for part in ast.walk(node)
    )


def called(call: ast.Call) -> str:
    return call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")


def asserting_helpers(file: SourceFile) -> frozenset[str]:
    """Return the functions of a test file, and those that it imports from helpers, that assert."""
    taken = set(file.imports)
    shared = [each for other in TESTS for each in other.functions if f"{other.module}.{each.name}" in taken]
    own = [node for node in file.functions if not node.name.startswith("test_")]
    return frozenset(node.name for node in (*shared, *own) if asserts(node)) | {"expect"}  # playwright's


def test_every_test_asserts_something() -> None:
    silent = []
    for file in TESTS:
        tests = [node for node in file.functions if node.name.startswith("test_") and not asserts(node)]
        helpers = asserting_helpers(file) if tests else frozenset()
        silent += [f"{file.name}:{node.lineno} {node.name}" for node in tests if not asserts(node, helpers)]
    assert not silent, lines("without an assertion", silent)


def test_every_test_has_a_name_of_its_own(request: pytest.FixtureRequest) -> None:
    """pytest-xdist runs one test of each name. The tests are those of this run; in `make test`, all."""
    times = Counter(item.nodeid for item in request.session.items)
    twice = [f"{name}: {count} tests" for name, count in times.items() if count > 1]
    assert not twice, lines("parametrize them so that each has a name of its own", twice)

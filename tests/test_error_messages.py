"""Every error that a user reads says what to do next: an instruction after what is wrong."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

import pytest

from tests.helpers.source_files import sources

#: Modules whose classes are the errors that users read.
TREES = ("instruments/errors.py", "procedures/contracts/errors.py", "labctl/errors.py")
#: The first word of an instruction.
VERBS = frozenset(
    re.findall(
        r"\w+",
        """
    abort accept add allow answer ask calibrate call change check choose clear compare configure confirm connect correct
    count create delete divide do end exchange export find fit free get give home import inspect install keep lay leave
    let list log lower make mark measure move name open pass pause plan press put query raise read record reduce remove
    rename repair repeat replace report request reset restart restore resume rewrite run save say send set shorten
    show sort start state stop subtract switch take tick try turn unlock update use wait write
    """,
    )
)
#: Where an instruction begins: after a stop, a colon or a conjunction.
CLAUSE = re.compile(r"(?:[;:.?,(]|\b(?:or|and|then|instead|first|once|where|until)\b)\s+([A-Za-z]+)")
#: A message may name the command to run, what was expected, or what can be chosen; or end with advice that a
#: variable holds.
ADVICE = re.compile(
    r"`[a-z]|--[a-z]|\bexpected\b|\(there are |^[A-Z][a-z]+ [a-z "
    r",]+\.$|\{[^{}]*(?:advice|hint|ADVICE|CHECK|insist|todo|known|do)\b[^{}]*\}",
    re.IGNORECASE,
)


#: What a campaign fails with: labctl/services/campaigns/failure_advice.py says what to do, and its tests hold that.
REASONS_OF_CAMPAIGNS = frozenset({"StepFailed", "SoakFailed", "BadData", "GuardTripped", "TableStopped", "Unanswered"})
PASSED_ON = "the text that it passes on says what to do"
#: Messages without an instruction, by module and beginning, and why.
EXCEPTIONS = {
    ("labctl/recording/checks.py", "{path}: {NO_REFERENCE}"): PASSED_ON,
    ("labctl/exports/registry.py", "format {format_name} is not known"): PASSED_ON,
    ("labctl/fitting/effects/formula.py", "formulas {path}: {error}"): PASSED_ON,
    ("labctl/fitting/estimation/axis_solutions.py", "{data.info.serial}, axis {axis}, model"): PASSED_ON,
    ("labctl/processes/supervisor.py", "stopped; {left.text}"): PASSED_ON,
    ("labctl/recording/data_files/values.py", "{self.path}: column"): PASSED_ON,
    ("labctl/recording/files.py", "{path}: {place}: {first['msg']}"): "the message of the schema says what is expected",
    ("labctl/services/benches/lease.py", "this process may not drive bench"): (
        "the campaign ends, and its advice says it"
    ),
    ("labctl/services/benches/lease.py", "{described(holder)}. {lease}"): PASSED_ON,
    ("labctl/services/planning/loading.py", "bench"): "the message of the schema says what is expected",
    ("labctl/services/recordings/importers.py", "{path}: {failure("): PASSED_ON,
    ("labctl/services/certificates/verification.py", "{path}: {error}"): PASSED_ON,
    ("labctl/services/simulation/plan_simulation.py", "bench {bench.name}: {error}"): PASSED_ON,
    ("labctl/store/connection/sqlite_file.py", "{self._location}: {text}"): PASSED_ON,
    ("labctl/store/connection/writer_lock.py", "{location}: {_describe("): PASSED_ON,
    ("labctl/store/repositories/keys.py", "key {name} was already revoked"): "nothing is left to do",
    (
        "procedures/recipe/recipe.py",
        "{source}: {_complaints(error)}",
    ): "the messages of the schema say what is expected",
}


def kinds() -> frozenset[str]:
    """Return the names of the classes of errors that users read."""
    files = {file.name: file for file in sources()}
    return (
        frozenset(node.name for tree in TREES for node in ast.walk(files[tree].tree) if isinstance(node, ast.ClassDef))
        - REASONS_OF_CAMPAIGNS
    )


def text_of(node: ast.expr) -> str | None:
    """Return a literal or f-string, its fields as `{source}`; None where it is neither."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        return "".join(
            str(part.value) if isinstance(part, ast.Constant) else "{" + ast.unparse(part.value) + "}"
            for part in node.values
            if isinstance(part, ast.Constant | ast.FormattedValue)
        )
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        left, right = text_of(node.left), text_of(node.right)
        return None if left is None and right is None else (left or "{}") + (right or "{}")
    return None


def messages() -> Iterator[tuple[str, str]]:
    """Yield where an error of a user is made, and its text."""
    names = kinds()
    for file in sources():
        if not file.is_runtime:
            continue
        for node in ast.walk(file.tree):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in names:
                found = [text for each in node.args[:3] if (text := text_of(each)) and " " in text]
                if found:
                    yield f"{file.name}:{node.lineno}", max(found, key=len)


def instructs(text: str) -> bool:
    """Return whether a message has an instruction."""
    words = (found.group(1).lower() for found in CLAUSE.finditer(text))
    return bool(ADVICE.search(text)) or any(word in VERBS for word in words)


def exceptions(where: str, text: str) -> list[tuple[str, str]]:
    """Return the exceptions that a message is under."""
    file = where.partition(":")[0]
    return [(name, begin) for name, begin in EXCEPTIONS if name == file and text.startswith(begin)]


def test_every_error_says_what_to_do() -> None:
    found = list(messages())
    assert len(found) > 200
    silent = [f"{where}: {text}" for where, text in found if not instructs(text) and not exceptions(where, text)]
    assert not silent, "\n".join(["say what to do next:", *silent])


def test_every_exception_is_still_needed() -> None:
    used = {key for where, text in messages() if not instructs(text) for key in exceptions(where, text)}
    assert used == set(EXCEPTIONS)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("column 'x' is missing; add it", True),
        ("port 1 is in use; name another", True),
        ("unit 'A' is not in this database; `labctl import DIR` adds it", True),
        ("kind is 'a' (expected b or c)", True),
        ("column 'x' is missing", False),
        ("the set point is out of range: nothing was written", False),
    ],
)
def test_an_instruction_is_recognised(text: str, says: bool) -> None:
    assert instructs(text) is says

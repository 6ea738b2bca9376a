"""What the documentation names exists: links, files, modules, classes, make targets, commands with their options."""

from __future__ import annotations

import importlib
import re
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import typer.main
from typer._click.core import Context
from typer.core import TyperCommand, TyperGroup, TyperOption

from labctl.cli.app import app
from tests.helpers.paths import ROOT

TOP_LEVEL = ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")
SOURCE_FOLDERS = (
    "instruments", "procedures", "labctl", "migrations", "tests", "benchmarks", "studies", "scripts", "examples",
    "docs", "requirements", ".ci",
)  # fmt: skip
PAGES = sorted(
    {
        *(ROOT / name for name in TOP_LEVEL),
        *(path for folder in ("docs", "labctl/examples") for path in (ROOT / folder).rglob("*.md")),
    }
)
CODE = re.compile(r"`+([^`]+)`+")
FENCE = re.compile(r"^```.*?$(.*?)^```$", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\(([^)#\s]+)(?:#[^)]*)?\)")
FOLDERS = "|".join(re.escape(folder) for folder in SOURCE_FOLDERS)
#: A path from the root, in a code span or a code block; `*` stands for any name.
ROOT_PATH = re.compile(rf"(?<![\w./-])(?:{FOLDERS})(?:/[\w*.-]+)+/?")
SOURCE_FILE = re.compile(r"^[\w./*-]+\.(?:py|js|css)$")
DOTTED = re.compile(r"(?<!\.)\b(?:labctl|instruments|procedures|benchmarks|studies|tests)(?:\.[A-Za-z_]\w*)+")
IMPORT = re.compile(r"^from ((?:labctl|instruments|procedures)[\w.]*) import ([\w, ]+)", re.MULTILINE)
#: A class is distinguished from an acronym or a product by at least two capitals with small letters behind them.
CLASS = re.compile(r"^(?:[A-Z][a-z0-9]+){2,}$")
BROWSER_CLASSES = {"EventSource"}
#: Fields and settings that makers of instruments write in this way.
MAKERS_NAMES = {"ClockSync", "SampleTimeFine", "SyncInCnt", "TimeSyncIn"}
MAKE = re.compile(r"(?:^|`)make ([a-z]+)", re.MULTILINE)
COMMAND = re.compile(r"(?:^|`)(?:\.venv/bin/)?(labctl (?!:)[^`\n]+)", re.MULTILINE)
#: Suffixes of file names that a user's folder has, not this project's.
#: Groups of entry points look like modules.
GROUPS = frozenset(
    tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["entry-points"],
)
NOT_MODULES = (".sqlite", ".toml", ".service", ".json", ".csv", ".h", ".md")


def spans(text: str) -> list[str]:
    """Return the code spans of a page, without its code blocks."""
    return CODE.findall(FENCE.sub("", text))


def in_code(text: str) -> str:
    """Return all code of a page, spans and blocks, a line each."""
    return "\n".join([*FENCE.findall(text), *spans(text)])


def offenders(found: Iterator[str]) -> str:
    return "\n".join(sorted(set(found)))


def each_page() -> Iterator[tuple[str, Path, str]]:
    for path in PAGES:
        yield str(path.relative_to(ROOT)), path, path.read_text(encoding="utf-8")


@cache
def source_files() -> tuple[str, ...]:
    """Return every source file, as a path from the root."""
    return tuple(
        str(path.relative_to(ROOT))
        for folder in SOURCE_FOLDERS
        for path in (ROOT / folder).rglob("*")
        if path.suffix in {".py", ".js", ".css"}
    )


@cache
def classes() -> frozenset[str]:
    """Return the name of every class of the project."""
    return frozenset(
        name
        for file in source_files()
        for name in re.findall(r"^\s*(?:export )?class (\w+)", (ROOT / file).read_text(encoding="utf-8"), re.MULTILINE)
    )


def test_links_lead_to_files() -> None:
    wrong = offenders(
        f"{page}: link to {target}"
        for page, path, text in each_page()
        for target in LINK.findall(FENCE.sub("", text))
        if "://" not in target and not (path.parent / target).exists()
    )
    assert not wrong, wrong


def test_paths_exist() -> None:
    wrong = offenders(
        f"{page}: {found}"
        for page, _, text in each_page()
        for found in ROOT_PATH.findall(in_code(text))
        if not any(ROOT.glob(found.rstrip("/.")))
    )
    assert not wrong, wrong


def test_source_files_exist_that_are_named_without_their_folder() -> None:
    wrong = offenders(
        f"{page}: {span}"
        for page, _, text in each_page()
        for span in spans(text)
        if SOURCE_FILE.match(span) and not any(f"/{file}".endswith(f"/{span}") for file in source_files())
    )
    assert not wrong, wrong


def resolves(dotted: str) -> bool:
    """Return whether a dotted name is a module, or an attribute of one."""
    module, _, attribute = dotted, "", ""
    while module:
        try:
            found = importlib.import_module(module)
        except ModuleNotFoundError:
            module, _, last = module.rpartition(".")
            attribute = f"{last}.{attribute}" if attribute else last
            continue
        for name in filter(None, attribute.split(".")):
            if not hasattr(found, name):
                return False
            found = getattr(found, name)
        return True
    return False


def dotted_names(text: str) -> Iterator[str]:
    code = in_code(text)
    for module, names in IMPORT.findall(code):
        yield from (f"{module}.{name.strip()}" for name in names.split(","))
    yield from (name for name in DOTTED.findall(code) if not name.endswith(NOT_MODULES))


def test_modules_and_their_names_can_be_imported() -> None:
    wrong = offenders(
        f"{page}: {name}"
        for page, _, text in each_page()
        for name in dotted_names(text)
        if page != "CHANGELOG.md" and name not in GROUPS and not resolves(name)
    )
    assert not wrong, wrong


def test_classes_exist() -> None:
    known = classes() | BROWSER_CLASSES | MAKERS_NAMES
    wrong = offenders(
        f"{page}: {span}"
        for page, _, text in each_page()
        for span in spans(text)
        if CLASS.match(span) and span not in known
    )
    assert not wrong, wrong


def test_make_targets_exist() -> None:
    targets = set(re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    wrong = offenders(
        f"{page}: make {target}"
        for page, _, text in each_page()
        for target in MAKE.findall(in_code(text))
        if target not in targets
    )
    assert not wrong, wrong


@cache
def whole_command() -> TyperCommand | TyperGroup:
    """Return the command line of labctl; making it takes 0.1 s, and the pages have some hundred lines."""
    return typer.main.get_command(app)


def faults_of(line: str) -> Iterator[str]:
    """Yield what of a command line labctl does not know; words in capitals stand for arguments, `a|b` for a choice."""
    line = re.split(r"\s#|   |; | ends |->", line)[0]
    words = line.replace("[", " ").replace("]", " ").split()[1:]
    at = [whole_command()]
    for word in words:
        groups = [command for command in at if isinstance(command, TyperGroup)]
        if word.startswith("--"):
            name = word.split("=")[0].rstrip(",.:")
            if name != "--help" and not any(name in option for option in options_of(at)):
                yield f"{word} in {line!r}"
        elif groups and re.match(r"^[a-z|-]+$", word) and word != "|":
            found = [(name, [group.get_command(Context(group), name) for group in groups]) for name in word.split("|")]
            yield from (f"{name} in {line!r}" for name, commands in found if not any(commands))
            at = [command for _, commands in found for command in commands if command]
        elif groups:  # an argument where a command is due: the line goes on as text
            return


def options_of(commands: list[TyperCommand | TyperGroup]) -> list[list[str]]:
    return [
        [*parameter.opts, *parameter.secondary_opts]
        for command in commands
        for parameter in command.params
        if isinstance(parameter, TyperOption)
    ]


def test_commands_and_options_exist() -> None:
    wrong = offenders(
        f"{page}: {fault}"
        for page, _, text in each_page()
        for line in COMMAND.findall("\n".join([*FENCE.findall(text), *(f"`{span}`" for span in spans(text))]))
        for fault in faults_of(line)
    )
    assert not wrong, wrong


def test_every_page_is_in_the_index() -> None:
    docs = ROOT / "docs"
    listed = {(docs / target).resolve() for target in LINK.findall((docs / "index.md").read_text(encoding="utf-8"))}
    wrong = offenders(
        str(path.relative_to(ROOT))
        for path in docs.rglob("*.md")
        if path.name != "index.md" and path.resolve() not in listed
    )
    assert not wrong, wrong

"""What a text says in brackets is shown: in rich's markup an unknown tag is left out.

Help texts are markup, and escape their brackets; what commands print is not markup.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import pytest
from typer.main import get_command
from typer.testing import CliRunner

from labctl.cli.app import app
from labctl.cli.output import console, print_heading, stderr, table
from tests.helpers.paths import ROOT

REFERENCE = ROOT / "docs" / "reference" / "command-line.md"
#: A word in brackets as the source has it, escaped or not.
BRACKETED = re.compile(r"\\?(\[[^\[\]\n]*\])")


def commands(command: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Yield every group and command of the command line with its words."""
    yield path, command
    for name, below in getattr(command, "commands", {}).items():
        yield from commands(below, (*path, name))


COMMANDS = dict(commands(get_command(app)))


def texts(command: Any) -> str:
    """Return the texts of a command, its options and its arguments as their authors wrote them."""
    written = [command.help, command.epilog, *(getattr(each, "help", "") for each in command.params)]
    return "\n".join(filter(None, written))


def shown(*path: str) -> str:
    """Return the help of a command as a terminal shows it, on one line and without the frames."""
    result = CliRunner().invoke(app, [*path, "--help"], env={"COLUMNS": "200", "TERM": "dumb"})
    assert result.exit_code == 0, result.output
    return " ".join(re.sub("[│─╭╮╰╯]", " ", result.output).split())


@pytest.mark.parametrize("path", COMMANDS, ids=" ".join)
def test_every_bracketed_word_of_a_help_text_is_shown(path: tuple[str, ...]) -> None:
    command = COMMANDS[path]
    on_terminal = shown(*path)
    metavars = [each.metavar for each in command.params if each.metavar and "[" in each.metavar]
    for word in [*BRACKETED.findall(texts(command)), *metavars]:
        assert word in on_terminal, f"{word} is missing in the help of labctl {' '.join(path)}: write \\{word}"
    assert "\\[" not in on_terminal


def test_the_reference_has_every_bracketed_word() -> None:
    reference = REFERENCE.read_text(encoding="utf-8")
    words = {word for command in COMMANDS.values() for word in BRACKETED.findall(texts(command))}
    assert "[fit]" in words
    assert sorted(word for word in words if word not in reference) == []


def test_what_a_command_prints_in_brackets_is_printed_as_it_is() -> None:
    for printer in (console, stderr):
        with printer.capture() as said:
            printer.print("its recipe has no [fit], see [bold]")
        assert said.get() == "its recipe has no [fit], see [bold]\n"
    rows = table("from [model]", "what [unit]")
    rows.add_row("missed: no [fit]")
    with console.capture() as said:
        print_heading("[short]", " on [bench]")
        console.print(rows)
    assert BRACKETED.findall(said.get()) == ["[short]", "[bench]", "[model]", "[unit]", "[fit]"]

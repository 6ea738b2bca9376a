"""Printing: one JSON document for programs, or readable text for people."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table
from rich.text import Text

if TYPE_CHECKING:
    from pydantic import BaseModel, JsonValue

    from labctl.answers.inspection import DataWarning

#: Without a terminal, lines are not cut to its width. Texts are printed as they are: a word in brackets is no markup.
console = Console(highlight=False, markup=False, emoji=False, width=None if sys.stdout.isatty() else 160)
stderr = Console(stderr=True, highlight=False, markup=False, emoji=False, soft_wrap=True)


#: A reader of standard error that takes nothing for so long is given up, s.
TAKES_WITHIN_S = 0.3
STDERR = 2


def give_up_blocked_stderr() -> None:
    """Discard standard error when its reader is blocked: the end of this process does not wait for it."""
    from labctl.log.writer import takes_text

    if not takes_text(STDERR, TAKES_WITHIN_S):
        nothing = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nothing, STDERR)
        os.close(nothing)


def print_heading(name: str, row_text: str = "") -> None:
    """Print a line that begins with a name in bold."""
    console.print(Text.assemble((name, "bold"), row_text))


def print_warnings(warnings: Iterable[DataWarning]) -> None:
    """Print the warnings of an answer, each on one line."""
    for warning in warnings:
        word = "wrong" if warning.severity == "certain" else "check"
        console.print(f"{word}: {warning.text}", style="bold red", soft_wrap=True)


def print_part(shown: int, total: int, what: str) -> None:
    """Print that a list is not whole, and how to see more of it; nothing where it is."""
    if shown < total:
        console.print(f"{shown} of {total} {what}; a larger --limit lists more, --search TEXT lists fewer")


def print_json(answer: BaseModel | Sequence[BaseModel] | Mapping[str, JsonValue], *, one_line: bool = False) -> None:
    """Print one JSON document on standard output; on one line and at once where a program waits for it."""
    from pydantic import BaseModel

    document: object = answer
    if isinstance(answer, BaseModel):
        document = answer.model_dump(mode="json", by_alias=True)
    elif not isinstance(answer, Mapping):
        document = [each.model_dump(mode="json", by_alias=True) for each in answer]
    indent = None if one_line else 2
    sys.stdout.write(json.dumps(document, indent=indent, ensure_ascii=False, allow_nan=False) + "\n")
    if one_line:
        sys.stdout.flush()


def table(title: str, *columns: str, numbers: int = 0) -> Table:
    """Make a table whose last `numbers` columns are numbers, right-aligned."""
    rows = Table(title=title, title_justify="left", title_style="bold", box=None, pad_edge=False, header_style="dim")
    for index, column in enumerate(columns):
        rows.add_column(
            column, justify="right" if index >= len(columns) - numbers else "left", no_wrap=index == 0, overflow="fold"
        )
    return rows


def format_number(value: float | None, digits: int = 4) -> str:
    """Write a number with `digits` significant digits, or a dash where there is none."""
    return "–" if value is None else f"{value:.{digits}g}"

"""Questions and lines of `labctl bench new` and `labctl bench wiggle` on a terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer
from rich.text import Text

from labctl.cli.output import console
from labctl.services.benches.new_bench import parse_setting

if TYPE_CHECKING:
    from labctl.answers.benches import FoundResponse


def asking(section: str, key: str, question: str, proposal: object) -> object:
    """Ask a person at the terminal; an empty answer keeps the proposal, or leaves the key out."""
    answer = typer.prompt(f"{section}.{key}: {question}", default="" if proposal is None else str(proposal))
    if not str(answer).strip():
        return None
    if key == "serial":
        return str(answer).strip()
    return parse_setting(f"{key}={answer}")[1]


def not_asking(section: str, key: str, question: str, proposal: object) -> object:  # noqa: ARG001  the proposal is enough
    """Ask nothing and keep the proposal."""
    return proposal


def print_search(line: FoundResponse) -> None:
    """Print what was found at one address."""
    mark = Text("found  ", "green") if line.driver else Text("nothing", "yellow")
    console.print(mark, f"  {line.address}  ", sep="", end="")
    console.print(f"{line.text}  [{line.driver}]" if line.driver else line.text, soft_wrap=True)

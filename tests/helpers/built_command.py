"""The command line as it was built from its declarations: it never changes, and costs 60 ms of processor time."""

from __future__ import annotations

from functools import cache
from typing import Any

import typer.main
import typer.testing

build = typer.main.get_command


@cache
def built(app: typer.Typer) -> Any:
    """Return the command of an application, built once in a process."""
    return build(app)


def build_once() -> None:
    """Let every run of a command in this process, and in those that are forked from it, take what was built."""
    typer.main.get_command = built
    setattr(typer.testing, "_get_command", built)  # noqa: B010  a private name, which the runner of tests calls

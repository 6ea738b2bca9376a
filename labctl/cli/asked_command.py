"""The part of the command line that a process needs: typer makes each option of each command, which takes 60 ms.

Where the first argument names a command or a group of commands, all others are left out; for the list of all commands,
their options are.
"""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from copy import copy

import typer
from typer.models import CommandInfo, TyperInfo


def part_for(app: typer.Typer, arguments: Sequence[str]) -> typer.Typer:
    """Return an application that answers these arguments as `app` does, in less time."""
    if list(arguments) == ["--help"]:
        return _with(app, list(map(_named, app.registered_commands)), list(map(_empty, app.registered_groups)))
    asked = arguments[0] if arguments else ""
    commands = [each for each in app.registered_commands if each.name == asked]
    groups = [each for each in app.registered_groups if each.name == asked]
    return _with(app, commands, groups) if commands or groups else app


def _with(app: typer.Typer, commands: list[CommandInfo], groups: list[TyperInfo]) -> typer.Typer:
    part = copy(app)
    part.registered_commands, part.registered_groups = commands, groups
    return part


def _named(command: CommandInfo) -> CommandInfo:
    """Return a command with its name and description, and without options."""
    named = copy(command)
    named.help = inspect.getdoc(command.callback) if command.help is None else command.help
    named.callback = _nothing
    return named


def _empty(group: TyperInfo) -> TyperInfo:
    """Return a group without its commands."""
    empty = copy(group)
    if group.typer_instance is not None:
        empty.typer_instance = _with(group.typer_instance, [], [])
    return empty


def _nothing() -> None:
    """Do nothing: a command that is only listed."""

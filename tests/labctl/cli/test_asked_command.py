"""The part of the command line that a process makes answers as the whole does."""

from __future__ import annotations

import pytest
from typer.testing import CliRunner

from labctl.cli.app import app
from labctl.cli.asked_command import part_for


@pytest.mark.parametrize(
    "arguments",
    [
        ["--help"],
        [],
        ["--version"],
        ["unit"],
        ["units", "--help"],
        ["units", "--due"],
        ["fit"],
        ["campaign"],
        ["campaign", "--help"],
        ["campaign", "start", "--help"],
        ["campaign", "begin"],
        ["export", "recording"],
        ["certificates", "--help"],
    ],
)
def test_a_part_prints_what_the_whole_prints(arguments: list[str]) -> None:
    part = CliRunner().invoke(part_for(app, arguments), arguments)
    whole = CliRunner().invoke(app, arguments)
    assert (part.output, part.exit_code) == (whole.output, whole.exit_code)
    assert len(part.output) > 5


def test_only_what_is_asked_for_is_made() -> None:
    assert [each.name for each in part_for(app, ["units", "--json"]).registered_commands] == ["units"]
    assert part_for(app, ["units"]).registered_groups == []
    assert [each.name for each in part_for(app, ["campaign", "list"]).registered_groups] == ["campaign"]
    assert part_for(app, ["no-such-command"]) is app
    listed = part_for(app, ["--help"])
    assert [each.name for each in listed.registered_commands] == [each.name for each in app.registered_commands]
    assert len(app.registered_groups) == len(listed.registered_groups) > 10

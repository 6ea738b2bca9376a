"""The files and commands that the how-to of extensions gives, read from the page."""

from __future__ import annotations

import re
from pathlib import Path

from tests.helpers.paths import ROOT

PAGE = ROOT / "docs" / "how-to" / "extending.md"
FILE = re.compile(r"^\*\*`([^`\n]+)`\*\*\n\n```\w+\n(.*?)^```$", re.MULTILINE | re.DOTALL)
SECTION = re.compile(r"^## (.+)$", re.MULTILINE)
COMMANDS = re.compile(r"^```sh\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def sections() -> dict[str, str]:
    """Return the text of each section by its title."""
    _, *parts = SECTION.split(PAGE.read_text(encoding="utf-8"))
    return dict(zip(parts[::2], parts[1::2], strict=True))


def files_of(text: str) -> dict[str, str]:
    """Return the files that a text gives, by path."""
    return dict(FILE.findall(text))


def write_files(text: str, folder: Path) -> None:
    """Write the files that a text gives below a folder."""
    for name, content in files_of(text).items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(content, encoding="utf-8")


def commands_of(text: str) -> list[str]:
    """Return the command lines that a text gives, in order."""
    return [line for block in COMMANDS.findall(text) for line in block.splitlines()]

"""The command line with a database of its own."""

from __future__ import annotations

import hashlib
import json
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

from typer.testing import CliRunner, Result

from labctl.cli.app import app


class Lab:
    """Runs labctl commands on one database in `folder`."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.database = folder / "lab.sqlite"

    def run(self, *arguments: str, status: int | None = 0) -> Result:
        """Run a command; it must end with this exit status, by default without an error; None is any."""
        result = CliRunner().invoke(app, [*arguments, "--database", str(self.database)])
        assert status in {None, result.exit_code}, result.output + result.stderr + repr(result.exception)
        return result

    def json(self, *arguments: str, status: int = 0) -> Any:
        """Return the JSON document that a command prints with --json; it must end with this exit status."""
        return json.loads(self.run(*arguments, "--json", status=status).stdout)

    def copy(self, folder: Path) -> Lab:
        """Copy everything of this lab, which no process may have open, into a folder; returns the copy."""
        shutil.copytree(self.folder, folder, dirs_exist_ok=True)
        return Lab(folder)

    def content(self) -> str:
        """Return a digest of every row of the database."""
        with closing(sqlite3.connect(self.database)) as raw:
            text = "\n".join(raw.iterdump())
        return hashlib.sha256(text.encode()).hexdigest()

"""The code blocks of the documentation: found by Sybil, executed page by page in a folder and database of their own."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from sybil import Document, Example, Lexeme, Region, Sybil
from sybil.evaluators.python import PythonEvaluator
from sybil.parsers.markdown import CodeBlockParser, PythonCodeBlockParser, SkipParser

from tests.helpers.forked_commands import ForkedCommand, shell_command
from tests.helpers.paths import ROOT
from tests.helpers.patience import WAIT_S
from tests.helpers.signal_defaults import default_signals

PAGES = sorted(
    {ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md", ROOT / "SECURITY.md"}
    | {page for page in (ROOT / "docs").rglob("*.md") if "_build" not in page.parts}
)
#: The address that the documentation shows for a service; a test's service has another port.
SHOWN_URL = "http://127.0.0.1:8420"
FENCE = re.compile(r"^(?: *)```(?P<language>[^\n]*)\n(?P<text>.*?)^(?: *)```$", re.MULTILINE | re.DOTALL)
SKIP = re.compile(r'<!-- skip: next(?: "(?P<reason>[^"]*)")? -->')
SERVE = re.compile(r"labctl serve(?P<options>[^\n#]*)")


@dataclass
class Playground:
    """The folder that the blocks of one page are executed in, and the service that one of them may have started."""

    folder: Path
    url: str = ""
    _service: subprocess.Popen[str] | None = field(default=None)

    def prepare(self) -> None:
        """Fill the folder as a newcomer's: links to the project's files, and `labctl` and `.venv/bin` on the path."""
        for entry in ROOT.iterdir():
            if not entry.name.startswith(".") and entry.suffix != ".sqlite":
                (self.folder / entry.name).symlink_to(entry)
        (self.folder / ".venv").symlink_to(sys.prefix)
        command = self.folder / ".bin" / "labctl"
        command.parent.mkdir()
        command.write_text(shell_command(), encoding="utf-8")
        command.chmod(0o755)

    @property
    def environment(self) -> dict[str, str]:
        """The environment of the blocks."""
        own = {"PATH": f"{self.folder / '.bin'}:{os.environ['PATH']}", "PYTHONPATH": str(ROOT)}
        kept = {name: value for name, value in os.environ.items() if not name.startswith("LABCTL_")}
        return kept | own | {"LABCTL_DATABASE": str(self.folder / "labctl.sqlite"), "COLUMNS": "120"}

    def shell(self, example: Example) -> None:
        """Execute a shell block; one that is `labctl serve` runs on until the page's end."""
        source = str(example.parsed)
        if served := SERVE.fullmatch(source.strip().partition("  #")[0].strip()):
            self._serve(served["options"].split())
            return
        with default_signals():
            done = subprocess.run(
                ["bash", "-euo", "pipefail", "-c", source.replace(SHOWN_URL, self.url or SHOWN_URL)],
                cwd=self.folder, env=self.environment, capture_output=True, text=True, timeout=WAIT_S * 2, check=False,
                stdin=subprocess.DEVNULL,
            )  # fmt: skip
        where = f"{example.path}:{example.line}"
        assert done.returncode == 0, f"{where}: exit {done.returncode}\n{source}\n{done.stdout}\n{done.stderr}"

    def _serve(self, options: list[str]) -> None:
        command = ["serve", *options, "--port", "0", "--json"]
        self._service = ForkedCommand(command, stderr=None, folder=self.folder, environment=self.environment)
        assert self._service.stdout is not None
        self.url = json.loads(self._service.stdout.readline())["url"]

    def close(self) -> None:
        """Stop the service, as Ctrl-C does."""
        if self._service is not None:
            self._service.send_signal(signal.SIGINT)
            self._service.communicate(timeout=WAIT_S)


class PythonBlocks(PythonEvaluator):
    """Executes Python blocks, with the address of the test's service in the place of the shown one."""

    def __init__(self, playground: Playground) -> None:
        super().__init__()
        self._playground = playground

    def __call__(self, example: Example) -> None:
        source = example.parsed
        text = str(source).replace(SHOWN_URL, self._playground.url or SHOWN_URL)
        example.parsed = Lexeme(text, source.offset, source.line_offset)
        super().__call__(example)


def parse(page: Path, playground: Playground) -> Document:
    """Return a page with its examples."""

    def python(document: Document) -> Iterator[Region]:
        for region in PythonCodeBlockParser()(document):
            region.evaluator = PythonBlocks(playground)
            yield region

    parsers = [SkipParser(), CodeBlockParser("sh", playground.shell), python]
    return Sybil(parsers=parsers, patterns=["*.md"]).parse(page)


@contextmanager
def open_playground(folder: Path) -> Iterator[Playground]:
    """Give a prepared folder; a service that a block starts ends with it."""
    made = Playground(folder)
    made.prepare()
    try:
        yield made
    finally:
        made.close()

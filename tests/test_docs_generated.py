"""The generated page of the command line is that of the program, and the site's contents are the index."""

from __future__ import annotations

import shutil
import subprocess
import sys
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path
from unittest.mock import patch

import pytest

from tests.helpers.paths import ROOT

PAGE = ROOT / "docs" / "reference" / "command-line.md"
WRITE = "typer labctl.cli.app utils docs --name labctl --output docs/reference/command-line.md"


def test_the_reference_of_the_command_line_is_that_of_the_program() -> None:
    command = [sys.executable, "-m", "typer", "labctl.cli.app", "utils", "docs", "--name", "labctl"]
    reported = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert reported.strip() == PAGE.read_text(encoding="utf-8").strip(), f"write it again: python -m {WRITE}"


def test_the_page_of_the_effects_is_that_of_the_catalogue() -> None:
    script = ROOT / "scripts" / "effects-page"
    loader = SourceFileLoader("effects_page", str(script))
    generator = module_from_spec(spec_from_loader("effects_page", loader))  # type: ignore[arg-type]
    with patch.object(sys, "dont_write_bytecode", new=True):
        loader.exec_module(generator)
    assert generator.page() == (ROOT / "docs" / "reference" / "effects.md").read_text(encoding="utf-8"), (
        "write it again: scripts/effects-page"
    )


def build(docs: Path, out: Path) -> str:
    """Build a site as `make docs` does; returns its warnings, which end it with an error."""
    options = ["--builder", "html", "--fail-on-warning", "--keep-going", "--quiet", "--no-color"]
    command = [sys.executable, "-m", "sphinx", *options, str(docs), str(out)]
    built = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert bool(built.stderr) == bool(built.returncode)
    return built.stderr


@pytest.mark.slow
def test_the_site_builds_without_a_warning(tmp_path: Path) -> None:
    assert not build(ROOT / "docs", tmp_path)
    contents = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert all(caption in contents for caption in ("Tutorials", "How-to", "Reference", "Explanation"))


def test_a_broken_link_anchor_or_picture_ends_the_build(tmp_path: Path) -> None:
    broken = {
        "[no page](none.md)": "none.md",
        "[no anchor](#no-anchor)": "no-anchor",
        "![no picture](none.png)": "image file not readable: none.png",
    }
    docs = tmp_path / "docs"
    docs.mkdir()
    shutil.copy(ROOT / "docs" / "conf.py", docs)
    (docs / "index.md").write_text("\n\n".join(["# Page", *broken]) + "\n", encoding="utf-8")
    warnings = build(docs, tmp_path / "site").splitlines()
    for number, said in zip((3, 5, 7), broken.values(), strict=True):
        assert any(f"index.md:{number}" in line and said in line for line in warnings), (said, warnings)

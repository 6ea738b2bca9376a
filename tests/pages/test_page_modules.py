"""The modules of the pages under node: their own tests, and whether their types are those of the OpenAPI document."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from labctl.api import create_app
from tests.helpers.paths import ROOT
from tests.helpers.patience import WAIT_S

MODULES = ROOT / "labctl" / "web" / "static" / "js"
TOOLS = ROOT / "node_modules" / ".bin"

needs_node = pytest.mark.skipif(shutil.which("node") is None, reason="no node (on Debian: apt-get install nodejs npm)")
needs_tools = pytest.mark.skipif(not TOOLS.is_dir(), reason="no packages for the pages (scripts/install-page-tools)")


def run(*words: str) -> None:
    """Run a command in the repository; what it said is the message of a failure."""
    ended = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False, timeout=WAIT_S)
    assert ended.returncode == 0, ended.stdout + ended.stderr


@needs_node
def test_pure_modules_do_what_their_tests_say() -> None:
    run("node", "--test", *(str(path) for path in sorted(Path(__file__).parent.glob("*.test.js"))))


@needs_node
@needs_tools
def test_types_are_generated_from_the_present_openapi_document(tmp_path: Path) -> None:
    """Otherwise: make types."""
    document = tmp_path / "openapi.json"
    document.write_text(json.dumps(create_app(None).openapi()), encoding="utf-8")  # needs no service
    run("npm", "run", "--silent", "types:check", "--", str(document))


IMPORTED = re.compile(r'(?:^import|^} from|^import .* from|import\()\s*"([^"]+)"', re.MULTILINE)


def test_a_module_is_served_as_it_is_written() -> None:
    """No build: what a module imports is a module beside it; types stand in comments."""
    modules = sorted(MODULES.rglob("*.js"))
    missing = [
        f"{module.relative_to(MODULES)}: {name}"
        for module in modules
        for name in IMPORTED.findall(module.read_text(encoding="utf-8"))
        if not (module.parent / name).resolve().is_relative_to(MODULES) or not (module.parent / name).is_file()
    ]
    assert len(modules) > 60
    assert not missing

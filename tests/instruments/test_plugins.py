"""Plug-ins by entry points: what cannot be used gives one line, and takes nothing else down."""

from __future__ import annotations

import logging
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from instruments import plugins
from instruments.plugins import PluginError, PluginGroup, UnknownPlugin, instance_of
from tests.helpers.distributions import distribution
from tests.helpers.paths import ROOT
from tests.helpers.patience import WAIT_S

GROUP = "labctl.widgets"


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder on the path in which distributions are installed for this test."""
    monkeypatch.syspath_prepend(str(tmp_path))
    plugins.installed.cache_clear()
    before = set(sys.modules)
    yield tmp_path
    plugins.installed.cache_clear()
    for name in set(sys.modules) - before:
        if Path(getattr(sys.modules[name], "__file__", None) or "").is_relative_to(tmp_path):
            del sys.modules[name]  # and no other, of which this process would then have two


def widgets() -> PluginGroup[int]:
    return PluginGroup(GROUP, "widget", instance_of(int))


def test_a_plug_in_is_imported_when_it_is_asked_for(site: Path) -> None:
    distribution(site, "acme-one", f"[{GROUP}]\none = acme_one:VALUE\n", "VALUE = 1\n")
    group = widgets()
    assert group.names == ("one",)
    plugin = group.plugin("one")
    assert (plugin.distribution, plugin.version, plugin.is_own) == ("acme-one", "0.3", False)
    assert "acme_one" not in sys.modules
    assert group.get("one") == 1
    assert "acme_one" in sys.modules


@pytest.mark.parametrize(
    ("code", "error"),
    [
        ("import no_such_module_of_acme\n", "ModuleNotFoundError: No module named 'no_such_module_of_acme'"),
        ("VALUE = (\n", "SyntaxError: '(' was never closed"),
        ("raise SystemExit('bye')\n", "SystemExit: bye"),
        ("raise RuntimeError('first line\\nsecond line')\n", "RuntimeError: first line;"),
        ("OTHER = 1\n", "AttributeError: module 'acme_bad' has no attribute 'VALUE'"),
        ("VALUE = 'text'\n", "TypeError: 'text' is not a builtins.int"),
    ],
)
def test_one_that_cannot_be_loaded_gives_one_line_and_takes_nothing_else_down(
    site: Path, caplog: pytest.LogCaptureFixture, code: str, error: str
) -> None:
    distribution(site, "acme-bad", f"[{GROUP}]\nbad = acme_bad:VALUE\n", code)
    distribution(site, "acme-good", f"[{GROUP}]\ngood = acme_good:VALUE\n", "VALUE = 7\n")
    group = widgets()
    with pytest.raises(PluginError) as caught:
        group.get("bad")
    line = str(caught.value)
    assert "entry point 'bad' (acme_bad:VALUE) of acme-bad 0.3 in group labctl.widgets" in line
    assert error in line
    assert line.endswith("; repair or uninstall acme-bad")
    assert "\n" not in line
    for _ in range(2):
        assert group.all() == {"good": 7}
    assert [record.getMessage() for record in caplog.records] == [line], "said once"
    assert group.problems() == [line]


def test_a_doubled_name_names_both_and_neither_is_used(site: Path) -> None:
    for name in ("acme-a", "acme-b"):
        distribution(site, name, f"[{GROUP}]\nsame = {name.replace('-', '_')}:VALUE\n", "VALUE = 1\n")
    distribution(site, "acme-c", f"[{GROUP}]\nother = acme_c:VALUE\n", "VALUE = 3\n")
    group = widgets()
    with pytest.raises(PluginError) as caught:
        group.get("same")
    assert "is of acme-a 0.3 (acme_a:VALUE) and acme-b 0.3 (acme_b:VALUE); none of them is used" in str(caught.value)
    assert group.all() == {"other": 3}


def test_a_name_of_labctls_own_stays_its_own(site: Path, caplog: pytest.LogCaptureFixture) -> None:
    distribution(site, "aaa", f"[{GROUP}]\nsame = aaa:VALUE\n", "VALUE = 1\n")
    distribution(site, "labctl", f"[{GROUP}]\nsame = labctl_own:VALUE\n")
    (site / "labctl.py").unlink()
    (site / "labctl_own.py").write_text("VALUE = 2\n", encoding="utf-8")
    group = widgets()
    assert group.all() == {"same": 2}
    (record,) = caplog.records
    assert "of labctl 0.3 (labctl_own:VALUE) and aaa 0.3 (aaa:VALUE); labctl's own is used" in record.getMessage()


def test_an_unknown_name_is_told_what_is_installed_and_what_to_do(site: Path) -> None:
    distribution(site, "acme-one", f"[{GROUP}]\nwidget-one = acme_one:VALUE\n", "VALUE = 1\n")
    with pytest.raises(UnknownPlugin) as caught:
        widgets().get("widget-on")
    assert str(caught.value) == (
        "no widget 'widget-on' is installed (installed: widget-one (acme-one 0.3)); did you mean 'widget-one'? If not, "
        "install the package that has it in its group labctl.widgets, or correct the name; labctl's own are not "
        "registered either: install labctl again (`make install`)"
    )


def test_metadata_that_cannot_be_read_is_left_out(site: Path, caplog: pytest.LogCaptureFixture) -> None:
    distribution(site, "acme-torn", f"[{GROUP}]\nno equals sign\n")
    distribution(site, "acme-good", f"[{GROUP}]\ngood = acme_good:VALUE\n", "VALUE = 7\n")
    assert widgets().all() == {"good": 7}
    assert any("cannot be read" in record.getMessage() for record in caplog.records)
    assert plugins.installed()


def test_of_two_versions_on_the_path_the_first_counts(
    site: Path, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    distribution(site, "acme-one", f"[{GROUP}]\none = acme_one:VALUE\n", "VALUE = 1\n", version="0.1")
    newer = tmp_path_factory.mktemp("newer")
    distribution(newer, "acme-one", f"[{GROUP}]\none = acme_one:VALUE\n", "VALUE = 2\n", version="0.2")
    monkeypatch.syspath_prepend(str(newer))
    plugins.installed.cache_clear()
    assert widgets().plugin("one").version == "0.2"


def test_parts_of_one_name_are_those_of_the_first(site: Path, caplog: pytest.LogCaptureFixture) -> None:
    for name in ("acme-a", "acme-b"):
        module = name.replace("-", "_")
        distribution(site, name, f"[{GROUP}]\n{module} = {module}:VALUE\n", f"VALUE = ['both', '{name}']\n")
    group: PluginGroup[list[str]] = PluginGroup(GROUP, "family", instance_of(list))
    found = group.merged(lambda parts: [(part, part) for part in parts], "part")
    assert list(found) == ["both", "acme-a", "acme-b"]
    (record,) = caplog.records
    assert record.levelno == logging.WARNING
    assert "acme-b 0.3" in record.getMessage()
    assert "part 'both' is left out: acme-a 0.3 has one of that name" in record.getMessage()


HELP = """
import sys
import typer.testing
from labctl.cli.app import app
assert typer.testing.CliRunner().invoke(app, ["--help"]).exit_code == 0
from instruments import plugins
loaded = [name for name in sys.modules if name.startswith("instruments.drivers.")]
print(plugins.installed.cache_info().currsize, *loaded)
"""


def test_help_reads_no_metadata_of_plug_ins_and_imports_no_driver() -> None:
    command = [sys.executable, "-c", HELP]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True, timeout=WAIT_S)
    assert done.stdout.split() == ["0"]

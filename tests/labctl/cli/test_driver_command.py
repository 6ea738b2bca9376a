"""`labctl driver test`: a driver is tried where it has a simulator; a wrong name gets the list of those installed."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

import pytest

from instruments.clock import VirtualClock
from labctl.services.benches import described_instruments
from tests.helpers.lab import CliRunner, app


def run(*arguments: str) -> tuple[int, str]:
    done = CliRunner().invoke(app, ["driver", "test", *arguments])
    return done.exit_code, done.output


def test_a_driver_is_tried_check_by_check() -> None:
    status, text = run("watlow-f4")
    lines = text.splitlines()
    assert status == 0
    assert all(line.startswith("does   ") for line in lines[:-1])
    assert "does   reads back its set point" in lines
    assert lines[-1].startswith("watlow-f4 of labctl ")
    assert lines[-1].endswith(f": all {len(lines) - 1} checks passed")


def test_it_is_tried_on_a_bench_of_ones_own(tmp_path: Path) -> None:
    from instruments.bench_config import shipped_benches

    bench = shipped_benches()["triaxial-sim"].read_text(encoding="utf-8")
    changed = bench.replace('"stim300"', '"stream-format"\nformat = "kvh-1750"').replace(
        "sim://stim300", "sim://stream-format"
    )
    (tmp_path / "own.toml").write_text(changed, encoding="utf-8")
    status, text = run("stream-format", "--bench", str(tmp_path / "own.toml"), "--json")
    answer = json.loads(text)
    assert (status, answer["ok"], answer["distribution"]) == (0, True, "labctl")
    assert len(answer["checks"]) == 11


def test_what_cannot_be_tried_is_one_line() -> None:
    status, text = run("watlow-f5")
    assert status == 2
    assert "no driver 'watlow-f5' is installed" in text
    assert text.count("\n") == 1
    status, text = run("stim300", "--bench", "single-axis-sim")
    assert status == 2
    assert "bench 'single-axis-sim' has no gyro with driver 'stim300'; name a bench that has one" in text
    status, text = run("watlow-f4", "--bench", "example-real")
    assert "CHAMBER1-if00-port0 on bench 'my-bench', but a driver is checked on a simulated instrument only" in text


def test_a_description_that_fails_names_its_wire_log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(described_instruments, "SystemClock", VirtualClock)
    status, text = run("examples/line-instruments/scpi-chamber.toml", "--host", "127.0.0.1:1")
    (file,) = tmp_path.iterdir()
    assert status == 1
    assert f"every byte is in {file}: add this file to a report of a fault" in text


def test_a_wire_log_of_a_driver_is_that_of_a_bench() -> None:
    status, text = run("watlow-f4", "--wire-log", "x.gz")
    assert status == 2
    assert "labctl bench check FILE --wire-log" in " ".join(text.replace("│", " ").split())

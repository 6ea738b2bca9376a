"""Stages of a criticism: reported in order; cancelled at any of them, it leaves nothing behind."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

import pytest

from labctl.answers.calibrations import FitRequest
from labctl.progress import Cancelled, reporting_to
from labctl.services.calibrations.fitting import fit_unit
from labctl.services.criticism.criticise import criticise_unit
from labctl.store import Store, open_store
from tests.helpers.simulated_recordings import single_axis

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)
FIRST = [
    "inspecting the recording", "fitting the model", "reading the recording", "reducing the recording",
    "preparing candidates",
]  # fmt: skip


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as opened:
        recording = single_axis(1)
        opened.recordings.add_import(recording, recording.info.started_at)
        fit_unit(opened, recording.info.serial, FitRequest(model="ojeda2000"), AT)
        yield opened


def stages_of(store: Store, serial: str) -> list[str]:
    received: list[str] = []
    with reporting_to(received.append):
        criticise_unit(store, serial, 1, None)
    return received


@pytest.mark.slow
def test_stages_are_reported_in_order_and_none_for_a_cached_answer(store: Store) -> None:
    (unit,) = store.units.all()
    received = stages_of(store, unit.serial)
    assert received[: len(FIRST)] == FIRST
    assert received[len(FIRST)].startswith("comparing ")
    assert received[len(FIRST)].endswith(" candidates, axis z")
    assert int(received[len(FIRST)].split()[1]) > 20
    assert received.index("listing suspects and residuals") > len(FIRST)
    assert stages_of(store, unit.serial) == []


@pytest.mark.slow
def test_cancelled_at_any_stage_it_leaves_no_file_and_can_be_asked_again(store: Store, cache: Path) -> None:
    (unit,) = store.units.all()
    before = sorted(cache.rglob("*"))
    received: list[str] = []

    def stop_at(number: int) -> None:
        met = 0

        def progress(stage: str) -> None:
            nonlocal met
            received.append(stage)
            met += 1
            if met > number:
                raise Cancelled(stage)

        with reporting_to(progress), pytest.raises(Cancelled):
            criticise_unit(store, unit.serial, 1, None)

    for number in range(len(FIRST) + 1):
        received.clear()
        stop_at(number)
        assert received[: len(FIRST)] == FIRST[: number + 1]
        assert sorted(cache.rglob("*")) == before
    assert stages_of(store, unit.serial)[: len(FIRST)] == FIRST
    assert sorted(cache.rglob("*")) != before


@pytest.mark.slow
def test_a_cached_answer_loads_no_fit() -> None:
    code = """
import sys, labctl.cli, labctl.services.commands.open, labctl.services.criticism.criticise
import labctl.cli.printing.criticism
heavy = {"scipy", "pyarrow", "alembic", "labctl.fitting", "instruments.bench"}
print(*sorted(heavy & set(sys.modules)))
"""
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ran.stdout.split() == []

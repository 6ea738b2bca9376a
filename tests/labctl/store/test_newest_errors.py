"""Errors of the newest versions of many units in one statement, and what made a recording, on both databases."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import pytest
import sqlalchemy as sa

from labctl.store import open_store
from labctl.store.repositories.calibrations import FitError
from labctl.store.schema import tables

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)


@pytest.mark.parametrize("kind", ["file", "server"])
def test_the_newest_versions_of_each_unit_have_their_errors(
    kind: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    location = str(tmp_path / "lab.sqlite") if kind == "file" else request.getfixturevalue("url")
    errors = {("A", k): {"error": {"rms_dps": 1.0 / k, "noise_floor_dps": 0.1}} for k in range(1, 6)}
    errors |= {("B", 1): {"error": {"rms_dps": None, "noise_floor_dps": 0.1}}, ("C", 1): {}}
    with open_store(location, write=True) as store:
        with store.units._database.writing() as connection:
            connection.execute(
                sa.insert(tables.units), [{"serial": serial, "model": "", "first_seen_at": AT} for serial in "ABCD"]
            )
            rows = [
                {
                    "serial": serial, "version": version, "model": "cubic", "hash": f"{serial}{version}".zfill(64),
                    "created_at": AT, "document": b"{}", "answer": answer,
                }
                for (serial, version), answer in errors.items()
            ]  # fmt: skip
            connection.execute(sa.insert(tables.calibrations), rows)
        found = store.calibrations.newest_errors(["A", "B", "C", "D"], 3)
        assert found == {
            "A": [FitError(k, pytest.approx(1.0 / k), 0.1) for k in (3, 4, 5)],  # type: ignore[arg-type]
            "B": [FitError(1, None, 0.1)],
            "C": [FitError(1, None, None)],
        }
        store.audit.record(AT, "simulate", "recording 7", {})
        store.audit.record(AT, "import", "recording 8", {})
        assert store.audit.simulated_recordings([6, 7, 8]) == {7}

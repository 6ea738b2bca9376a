"""What the demo shows: an effect that a schedule cannot name, experiments that can, and an error at the floor."""

from __future__ import annotations

from pathlib import Path
from typing import Any, cast

import pytest

from labctl.cli.demo.find_missing_effect import HIDDEN, SERIAL, simulated_gyro
from labctl.cli.demo.runner import DemoRunner, maybe_silent
from labctl.store import open_store


@pytest.mark.slow
def test_an_experiment_names_the_hidden_effect_and_the_error_falls_to_the_floor(tmp_path: Path) -> None:
    with maybe_silent(True) as console, open_store(str(tmp_path / "demo.sqlite"), write=True) as store:
        demo = DemoRunner(store, tmp_path, console, quiet=True)
        simulated_gyro(demo)
        told = cast("dict[str, Any]", demo.figures["hidden"])
        (answer,) = [
            cast("dict[str, Any]", row.answer) for row in store.calibrations.of_unit(SERIAL) if row.version == 2
        ]
    assert told["verdict"] == "ambiguous"
    assert {*HIDDEN} < {*told["named_at_first"]}
    assert told["named"] == [*HIDDEN]
    assert 1 <= told["experiments"] <= 3
    assert 0 < told["hours"] <= 2.0
    assert told["verdict_after"] == "adequate"
    error, before = answer["error"], answer["before"]
    assert error["rms_dps"] < error["noise_floor_dps"] < before["rms_dps"]

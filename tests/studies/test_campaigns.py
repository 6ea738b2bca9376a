"""The study's campaigns: what is done to them, the sizes of what is hidden in them, and resuming."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from instruments.clock import VirtualClock
from instruments.simulation import hidden_defaults, open_simulation
from studies import criticism
from studies.campaigns import PROTOCOLS, campaign, drifting, protocol, spoiled
from studies.effect_sizes import COMMAND, Z_LEVELS, sizes, sizing_of

WITHIN = 0.25


@pytest.mark.parametrize("name", PROTOCOLS)
def test_sizes_are_kept_for_every_protocol(name: str) -> None:
    kept = sizes(name)
    assert len(kept) > 10
    assert set(kept) <= set(hidden_defaults())
    for by_z in kept.values():
        assert list(by_z) == [f"{z:g}" for z in Z_LEVELS]
        assert list(map(abs, by_z.values())) == sorted(map(abs, by_z.values()))


@pytest.mark.slow
@pytest.mark.parametrize("effect", ["scale_factor_asymmetry", "rate_hysteresis"])
def test_a_kept_size_still_gives_its_z(effect: str) -> None:
    """If this fails the simulator or the model has changed: make the sizes again (`python -m studies.effect_sizes`)."""
    sizing = sizing_of("O")
    for z in (5.0, 100.0):
        found, _ = sizing.z_of(effect, sizes("O")[effect][f"{z:g}"])
        assert found == pytest.approx(z, rel=WITHIN), f"{effect}: run {COMMAND}"


@pytest.mark.parametrize("name", ["O", "Y"])
def test_three_times_the_drift_is_three_times_the_units_own(name: str) -> None:
    p = protocol(name)

    def instability(bench: Any) -> float:
        return float(open_simulation(bench, VirtualClock()).world.gyro(p.gyro.name).truth.instability_dps)

    assert instability(drifting(p.bench, p.gyro, 3.0)) == pytest.approx(3.0 * instability(p.bench))


def test_a_share_of_readings_is_far_off_and_a_share_of_data_sets_missing() -> None:
    clean = campaign("O", 3, {})
    dirty = spoiled(clean, 3, 0.01, 0.03)
    there = np.unique(np.asarray(dirty.columns["dataset"]))
    assert len(there) == 121 - round(0.03 * 121)
    kept = np.isin(np.asarray(clean.columns["dataset"]), there)
    moved = np.abs(dirty.columns["gyro_z"] - clean.columns["gyro_z"][kept])
    assert np.mean(moved > 4.9) == pytest.approx(0.01, abs=0.003)
    assert np.all((moved == 0) | (moved > 4.9))


def test_every_cell_draws_effects_evenly_and_no_task_twice() -> None:
    tasks = list(criticism.tasks())
    assert len({json.dumps(task, sort_keys=True) for task in tasks}) == len(tasks)
    drawn = [next(iter(t["hidden"])) for t in tasks if (t["protocol"], t["kind"], t["z"]) == ("Y", "effect", 10.0)]
    counts = [drawn.count(effect) for effect in set(drawn)]
    assert len(drawn) == criticism.PER_CELL
    assert max(counts) - min(counts) <= 1


def test_what_was_answered_is_not_asked_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    task = {"protocol": "O", "kind": "nothing", "z": 0.0, "seed": 1, "hidden": {}}
    said = {**task, "verdict": "adequate", "named": [], "nodes": 0, "depends_on": [], "seconds": {"labctl": 0.1}}
    monkeypatch.setattr(criticism, "FOLDER", tmp_path)
    monkeypatch.setattr(criticism, "WITH_PEERS", False)
    monkeypatch.setattr(criticism, "tasks", lambda: iter([task]))
    monkeypatch.setattr(criticism, "one", None)
    criticism.answers_file().write_text(json.dumps(said) + '\n{"protocol": "O", "ki')
    assert "1 nothing" in criticism.run()


@pytest.mark.slow
def test_one_campaign_is_simulated_and_criticised(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(criticism, "WITH_PEERS", False)
    size = sizes("O")["scale_factor_asymmetry"]["30"]
    task = {"protocol": "O", "kind": "effect", "z": 30.0, "seed": 20_001, "hidden": {"scale_factor_asymmetry": size}}
    answer = criticism.one(task)
    assert (answer["verdict"], answer["named"]) == ("missing", ["scale_factor_asymmetry"])
    assert 0.5 < answer["held_out"] < 1.6

"""A campaign with a reference thermometer and hygrometer: columns of every data set, and the temperature of the fit."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from instruments.bench import open_bench
from instruments.bench_config import BenchFile, read_bench
from instruments.clock import VirtualClock
from instruments.simulation import open_simulation
from labctl.errors import BadInput
from labctl.fitting.estimation.fit import fit
from labctl.services.campaigns.execution import run
from labctl.services.campaigns.preparation import prepare
from labctl.store import Store, open_store

URL = "sim://line-reference/reference"


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as opened:
        yield opened


def bench_of(gyro: dict[str, Any] | None = None, **reference: Any) -> BenchFile:
    record = read_bench("single-axis-sim").model_dump()
    record["gyros"] = [record["gyros"][0] | (gyro or {})]
    record["references"] = [{"driver": "line-reference", "port": URL, "model": "omega-ithx", **reference}]
    return BenchFile.model_validate(record)


def campaign(store: Store, bench: BenchFile, silent: tuple[float, float] | None = None) -> Any:
    clock = VirtualClock()
    simulation = open_simulation(bench, clock)
    prepared = prepare(store, "short", bench, clock, clip=False, opened=open_bench(bench, clock, simulation))
    if silent is not None:
        simulation.faults(URL).arm("silence", from_s=silent[0], until_s=silent[1])
    return run(store, prepared)


@pytest.mark.slow
def test_the_reference_is_the_temperature_of_the_fit_and_its_values_are_columns(store: Store) -> None:
    bench = bench_of(is_temperature=True, certificate="NMI 4711", u_c=0.02, corrections={"reference_c": 0.5})
    ended = campaign(store, bench)
    assert ended.state == "done", ended.reason
    recording = store.recordings.points(ended.recordings["FOG-0001"])
    columns = {name: np.asarray(values) for name, values in recording.columns.items()}
    assert len(columns["dataset"]) == 15
    assert columns["temperature_c"] == pytest.approx(columns["reference_c"])
    assert columns["reference_c"] == pytest.approx(columns["chamber_c"] + 0.5, abs=0.05)
    assert np.abs(columns["own_temperature_c"] - columns["temperature_c"]).max() > 0.1
    assert columns["humidity_pct"].min() > 10
    assert recording.info.notes == (
        "temperature_c is by reference, omega-ithx, certificate NMI 4711, standard uncertainty 0.02 K"
    )
    assert recording.environment is not None
    assert np.asarray(recording.environment["temperature_c"]) == pytest.approx(
        np.asarray(recording.environment["chamber_c"]) + 0.5, abs=0.051
    )
    assert len(store.recordings.samples(ended.recordings["FOG-0001"]).columns["reference_c"]) > 1000


@pytest.mark.slow
def test_a_unit_without_a_thermometer_is_fitted_by_the_reference(store: Store) -> None:
    unit = {"driver": "kvh-dsp3000", "port": "sim://kvh-dsp3000/fog", "sample_rate_hz": 100}
    ended = campaign(store, bench_of(unit, is_temperature=True))
    assert ended.state == "done", ended.reason
    recording = store.recordings.points(ended.recordings["FOG-0001"])
    assert "own_temperature_c" not in recording.columns
    warm = np.asarray(recording.columns["temperature_c"])
    assert [warm[n : n + 5].mean() for n in (0, 5, 10)] == pytest.approx([24, 26, 28], abs=0.3)
    assert fit(recording, "bias_scale").temperature_c == pytest.approx((24, 28), abs=0.3)


@pytest.mark.slow
def test_a_reference_that_is_not_chosen_is_kept_beside_the_units_own_thermometer(store: Store) -> None:
    ended = campaign(store, bench_of())
    columns = store.recordings.points(ended.recordings["FOG-0001"]).columns
    assert "own_temperature_c" not in columns
    assert np.abs(np.asarray(columns["reference_c"]) - np.asarray(columns["temperature_c"])).max() > 0.1


@pytest.mark.slow
def test_a_short_silence_is_survived_and_said(store: Store) -> None:
    ended = campaign(store, bench_of(), silent=(700.0, 730.0))
    assert ended.state == "done", ended.reason
    events = [(event.kind, event.device) for event in store.campaigns.events(ended.id)]
    assert ("link.degraded", "reference") in events
    assert ("link.well", "reference") in events


def test_a_column_has_one_source(store: Store) -> None:
    record = bench_of().model_dump()
    record["references"] = list(record["references"])
    record["references"].append({**record["references"][0], "name": "second", "port": "sim://line-reference/second"})
    bench, clock = BenchFile.model_validate(record), VirtualClock()
    with pytest.raises(BadInput, match=r"second: column humidity_pct has another source already; set columns = \{ hum"):
        prepare(store, "short", bench, clock, clip=False)
    record["references"][1]["columns"] = {"reference_c": "outside_c", "humidity_pct": "outside_humidity_pct"}
    prepare(store, "short", BenchFile.model_validate(record), clock, clip=False)

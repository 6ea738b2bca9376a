"""Errors of a simulated bench: drawn from what its standards state, and felt by the units."""

from __future__ import annotations

import math

import numpy as np
import pytest

from instruments.bench_config import BenchFile, read_bench
from instruments.clock import VirtualClock
from instruments.simulation import open_simulation
from instruments.simulators.physics.bench_errors import BenchErrors
from instruments.standards import Standard


def test_errors_have_the_stated_distributions() -> None:
    standards = (
        Standard(quantity="clock", expanded=20.0),
        Standard(quantity="thermometer", half_width=0.3, distribution="rectangular"),
        Standard(quantity="fixture_angle", u=0.1),
        Standard(quantity="tilt", half_width=0.2, distribution="u-shaped"),
        Standard(quantity="level", half_width=0.6, distribution="triangular"),
    )
    drawn = [BenchErrors.drawn(standards, [seed]) for seed in range(2000)]
    assert np.std([1e6 * one.rate for one in drawn]) == pytest.approx(10, rel=0.06)
    warm = np.array([one.air_c for one in drawn])
    assert np.abs(warm).max() <= 0.3
    assert np.std(warm) == pytest.approx(0.3 / math.sqrt(3), rel=0.04)
    leans = np.degrees([one.lean_rad for one in drawn])
    assert leans.shape == (2000, 3, 2)
    assert np.std(leans) == pytest.approx(math.hypot(0.1, 0.2 / math.sqrt(2)), rel=0.05)
    assert np.std([one.level_deg for one in drawn]) == pytest.approx(0.6 / math.sqrt(6), rel=0.06)
    assert BenchErrors.drawn((), [1]) == BenchErrors()


@pytest.mark.parametrize("up", [0, 1, 2])
def test_a_unit_that_leans_feels_the_rate_across(up: int) -> None:
    leans = [(0.0, 0.0)] * 3
    leans[up] = (1e-3, -2e-3)
    table = np.zeros((1, 3))
    table[0, up] = 100.0
    felt = BenchErrors(lean_rad=tuple(leans)).felt(table, up)[0]
    assert felt[(up + 1) % 3] == pytest.approx(0.1, rel=1e-4)
    assert felt[(up + 2) % 3] == pytest.approx(-0.2, rel=1e-4)
    assert np.linalg.norm(felt) == pytest.approx(100.0)
    assert felt[up] < 100.0


def test_a_bench_is_exact_unless_its_errors_are_drawn() -> None:
    bench = read_bench("triaxial-sim")
    assert open_simulation(bench, VirtualClock()).world.errors == BenchErrors()
    record = bench.model_dump()
    world = open_simulation(
        BenchFile.model_validate({**record, "simulation": {"seed": 2, "draw_standards": True}}), VirtualClock()
    ).world
    indicated = np.full(1, 400.0)
    world.mount(0.0, "x")
    felt = world.body_rates(indicated, np.zeros(1))[0]
    assert world.errors.rate != 0
    assert felt[0] == pytest.approx(400 / (1 + world.errors.rate), abs=0.01)  # and the Earth's rate
    assert felt[1] == pytest.approx(400 * world.errors.lean_rad[0][0], abs=0.005)
    warm = world.heat.sensor_c("mems", np.array([30_000.0]))[0]
    assert world.heat.air_c(30_000.0) - warm == pytest.approx(world.errors.air_c, abs=0.1)

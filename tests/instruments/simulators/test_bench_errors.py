"""Errors of a simulated bench: drawn from what its standards state, and felt by the units."""

from __future__ import annotations

import math

import numpy as np
import pytest

from instruments.bench_config import BenchFile, read_bench
from instruments.clock import VirtualClock
from instruments.positions import Position
from instruments.simulation import open_simulation
from instruments.simulators.physics.bench_errors import BenchErrors, felt
from instruments.simulators.physics.body_kinematics import BodyFrame, EarthRotation
from instruments.standards import Standard

ENDS = ("x", "-x", "y", "-y", "z", "-z")


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
    faces = np.degrees([[one.fixture_rad[end] for end in ENDS] for one in drawn])
    assert faces.shape == (2000, 6, 2)
    assert np.std(faces) == pytest.approx(0.1, rel=0.02)
    assert np.abs(np.corrcoef(faces.reshape(2000, 12).T) - np.eye(12)).max() < 0.1  # each face is off by itself
    assert np.std(np.degrees([one.table_rad for one in drawn])) == pytest.approx(0.2 / math.sqrt(2), rel=0.05)
    assert np.std([one.level_deg for one in drawn]) == pytest.approx(0.6 / math.sqrt(6), rel=0.06)
    assert BenchErrors.drawn((), [1]) == BenchErrors()


@pytest.mark.parametrize("end", ENDS)
def test_a_unit_that_leans_feels_the_rate_across(end: str) -> None:
    frame = BodyFrame.of(Position.of(end))
    table = np.zeros((1, 3))
    table[0, frame.up] = frame.sign * 100.0
    found = felt(table, frame, (1e-3, -2e-3))[0]
    assert found[frame.first] == pytest.approx(0.1, rel=1e-4)
    assert found[frame.second] == pytest.approx(-0.2, rel=1e-4)
    assert np.linalg.norm(found) == pytest.approx(100.0)
    assert abs(found[frame.up]) < 100.0


def test_what_a_turn_leaves_behind_changes_its_direction_in_the_frame_of_the_unit() -> None:
    errors = BenchErrors(fixture_rad={"x": (1e-3, 2e-3), "-x": (5e-3, 0.0)}, table_rad=(3e-4, -1e-4))
    at = {text: np.array(errors.lean_rad(Position.of(text), 1)) for text in ("x", "x@180", "x@0/180", "x@90", "-x@90")}
    assert at["x"] == pytest.approx([1.3e-3, 1.9e-3])
    assert at["x@180"] == pytest.approx(-at["x"])  # fixture and table stay behind
    assert at["x"] + at["x@0/180"] == pytest.approx([2e-3, 4e-3])  # only the table does
    assert at["x@90"] == pytest.approx([1.9e-3, -1.3e-3])  # counter-clockwise seen from above: y is where z was
    assert at["-x@90"] == pytest.approx([-1e-4, 5.3e-3])  # upside down the second axis lies the other way


def test_north_goes_round_with_a_turn_as_with_the_table() -> None:
    earth, none = EarthRotation(45.0, 33.0), np.zeros(1)
    for end in ENDS:
        turned, straight = (BodyFrame.of(Position.of(text)) for text in (f"{end}@60/30", end))
        assert earth.body_rates(turned, none, none) == pytest.approx(earth.body_rates(straight, none, none + 90.0))


def test_each_mounting_is_off_by_its_repeatability() -> None:
    standards = (Standard(quantity="mounting_repeatability", u=0.01),)
    errors = BenchErrors.drawn(standards, [3])
    leans = np.degrees([errors.lean_rad(Position.of("z"), number) for number in range(2000)])
    assert np.std(leans) == pytest.approx(0.01, rel=0.05)
    assert errors.lean_rad(Position.of("z"), 7) == BenchErrors.drawn(standards, [3]).lean_rad(Position.of("z"), 7)


def test_a_bench_is_exact_unless_its_errors_are_drawn() -> None:
    bench = read_bench("triaxial-sim")
    assert open_simulation(bench, VirtualClock()).world.errors == BenchErrors()
    record = bench.model_dump()
    world = open_simulation(
        BenchFile.model_validate({**record, "simulation": {"seed": 2, "draw_standards": True}}), VirtualClock()
    ).world
    indicated = np.full(1, 400.0)
    world.mount(0.0, "x")
    found = world.body_rates(indicated, np.zeros(1))[0]
    assert world.errors.rate != 0
    assert found[0] == pytest.approx(400 / (1 + world.errors.rate), abs=0.01)  # and the Earth's rate
    assert found[1] == pytest.approx(400 * world.errors.lean_rad(Position.of("x"), 1)[0], abs=0.005)
    warm = world.heat.sensor_c("mems", np.array([30_000.0]))[0]
    assert world.heat.air_c(30_000.0) - warm == pytest.approx(world.errors.air_c, abs=0.1)

"""The distance of a unit from the axis of the table: as text of a position, in a bench file, in the simulated world."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.spatial.transform import Rotation

from instruments.bench_config import BenchFile
from instruments.eccentricity import Eccentricity
from instruments.positions import MAX_LENGTH, Position
from instruments.simulators.physics.world import World
from instruments.standards import Standard
from labctl.services.planning.loading import load_bench

SAID = ("zr200", "zr200x", "-zr60-x", "zr200x@180", "x+yr20z", "x+y+zr200", "zr60@0/90", "zr0")


@pytest.mark.parametrize("text", SAID)
def test_a_position_says_the_distance_in_millimetres(text: str) -> None:
    position = Position.of(text)
    assert str(position) == text
    assert position.radius_mm is not None
    assert position.radius_m == position.radius_mm / 1000
    assert "r" not in str(position.without_radius)
    assert position.without_radius.up == position.up


@pytest.mark.parametrize("text", ["zr", "zr12345", "zr200z", "x+yr20x", "zx", "-zr200x@180", "z@180r200"])
def test_what_says_no_distance_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"is not a position .*zr200"):
        Position.of(text)


@pytest.mark.parametrize("end", ["z", "-z", "x", "-y"])
@pytest.mark.parametrize("angle", [0, 90, 37])
def test_a_turn_on_the_fixture_leaves_the_direction_behind(end: str, angle: int) -> None:
    straight = Position.of(end)
    outward = "x" if straight.axis != "x" else "-z"
    first = np.array(Position.of(f"{end}r90{outward}").outwards)
    turned = replace(straight, radius_mm=90, outward=outward, unit_deg=angle)
    back = Rotation.from_rotvec(-np.radians(angle) * np.array(straight.up))
    np.testing.assert_allclose(turned.outwards, back.apply(first), atol=1e-15)
    assert replace(turned, fixture_deg=90).outwards is None


def test_a_distance_is_said_as_far_as_there_is_room() -> None:
    straight, turned = Position.of("z"), Position.of("-z@180")
    assert str(straight.at_radius(200, "x")) == "zr200x"
    assert str(turned.at_radius(200, "-x")) == "-zr200@180"
    assert len(str(turned.at_radius(9999, "-x"))) <= MAX_LENGTH
    assert str(Position.of("z@0/180").at_radius(60)) == "z@0/180"  # the table is not said to turn the place with it


STATED: dict[str, Any] = {"radius_m": 0.06, "other_radii_m": [0.2, 0.05], "outward": {"z": "x", "-z": "-y"}}


def test_a_bench_file_states_the_distances() -> None:
    stated = Eccentricity.model_validate(STATED)
    assert stated.furthest_m == 0.2
    assert [stated.mounted(each) for each in ("z", "-z", "x", "zr200", "z@90")] == [
        "zr60x", "-zr60-y", "xr60", "zr200x", "zr60x@90",
    ]  # fmt: skip
    assert Eccentricity(radius_m=0.06).furthest_m is None


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"radius_m": 0.0605}, "no whole number of millimetres; round it"),
        ({"radius_m": -0.1}, "greater than or equal to 0"),
        ({"radius_m": 10.0}, "less than or equal to 9.999"),
        ({"other_radii_m": [0.06]}, "the radius 0.06 m is given twice"),
        ({"outward": {"z": "z"}}, 'z = "z": give for what points up'),
        ({"outward": {"z@90": "x"}}, "give for what points up"),
        ({"outward": {"z": "w"}}, "give for what points up"),
        ({"radius": 1}, "Extra inputs"),
    ],
)
def test_what_is_no_distance_has_a_clear_error(changes: dict[str, Any], said: str) -> None:
    bench = load_bench("single-axis-sim").model_dump(exclude_unset=True)
    with pytest.raises(ValidationError, match=said):
        BenchFile.model_validate({**bench, "eccentricity": {**STATED, **changes}})


def world_of(position: str, **changes: Any) -> World:
    world = World(load_bench("triaxial-sim").model_copy(update=changes))
    world.mount(0.0, position)
    return world


@pytest.mark.parametrize("position", ["zr200x", "-zr200y", "xr200-y@90", "zr200", "x+y+zr200"])
def test_the_simulated_unit_is_pulled_towards_the_axis(position: str) -> None:
    world, place = world_of(position), Position.of(position)
    rates = np.array([0.0, 90.0, -90.0, 180.0])
    pull = world.specific_force(np.zeros(4), rates) - world.gravity(np.zeros(4))
    size_g = np.radians(rates) ** 2 * 0.2 / 9.80665
    assert np.linalg.norm(pull, axis=1) == pytest.approx(size_g, rel=1e-12)
    np.testing.assert_allclose(pull @ np.array(place.up), 0.0, atol=1e-15)
    if place.outwards is not None:
        np.testing.assert_allclose(pull, np.outer(-size_g, place.outwards), atol=1e-12)


def test_the_simulated_unit_is_where_the_bench_says_or_on_the_axis() -> None:
    usual = world_of("z", eccentricity=Eccentricity(radius_m=0.06))
    assert (usual.radius_m, world_of("zr200").radius_m, world_of("z").radius_m) == (0.06, 0.2, None)
    np.testing.assert_array_equal(
        world_of("z").specific_force(np.zeros(1), np.array([90.0])), world_of("z").gravity(np.zeros(1))
    )


def test_the_true_distance_is_drawn_from_its_standard() -> None:
    simulation = load_bench("triaxial-sim").simulation
    assert simulation is not None
    radii_m = []
    for seed in range(300):
        drawn = simulation.model_copy(update={"draw_standards": True, "seed": seed})
        changes = {"standards": (Standard(quantity="radius", u=0.002),), "simulation": drawn}
        radii_m.append(world_of("zr200", **changes).radius_m)
    assert np.std(np.array(radii_m, dtype=float)) == pytest.approx(0.002, rel=0.15)
    assert np.mean(np.array(radii_m, dtype=float)) == pytest.approx(0.2, abs=0.0005)

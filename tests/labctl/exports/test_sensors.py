"""Formats of sensors: the formula that each file states, run on its numbers, gives what the parameters mean."""

from __future__ import annotations

import json
import shlex
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from labctl.errors import BadInput
from labctl.exports.sensors.formats import written
from labctl.exports.sensors.parameters import AccelerometerParameters, MagnetometerParameters, Parameters
from tests.helpers.magnetic_turns import HARD_IRON_UT, SOFT_IRON, fields
from tests.helpers.poses_at_rest import BIAS_G, ERRORS, poses

G = 9.80665
ACCELEROMETER = AccelerometerParameters(BIAS_G, ERRORS, 1.0, np.eye(9), 0.0013)
MAGNETOMETER = MagnetometerParameters(HARD_IRON_UT, SOFT_IRON, np.eye(10))
FORCE = poses(20, 1) * G
#: Parameters, true inputs and readings without noise.
CASES = [
    pytest.param(ACCELEROMETER, FORCE, FORCE @ (np.eye(3) + ERRORS).T + BIAS_G * G, id="accelerometer"),
    pytest.param(MAGNETOMETER, fields(20), fields(20) @ np.linalg.inv(SOFT_IRON).T + HARD_IRON_UT, id="magnetometer"),
]


@pytest.mark.parametrize(("found", "true", "readings"), CASES)
def test_json_and_python_correct_a_reading(found: Parameters, true: np.ndarray, readings: np.ndarray) -> None:
    document = json.loads(written(found, ["head"], "json", None, None))
    corrected = (readings - document["offset"]) @ np.array(document["matrix"]).T
    assert corrected == pytest.approx(true, abs=1e-12)
    assert len(document["covariance"]["of"]) == len(document["covariance"]["values"])
    module: dict[str, object] = {}
    exec(written(found, ["a */ line"], "python", None, None), module)
    correct = module["correct"]
    assert callable(correct)
    assert np.array([correct(row) for row in readings]) == pytest.approx(true, abs=1e-12)


@pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler")
@pytest.mark.parametrize(("found", "true", "readings"), CASES)
def test_the_c_header_corrects_a_reading(
    tmp_path: Path, found: Parameters, true: np.ndarray, readings: np.ndarray
) -> None:
    (tmp_path / "sensor.h").write_text(written(found, ["a */ line"], "c", None, None), encoding="ascii")
    (tmp_path / "main.c").write_text(
        '#include <stdio.h>\n#include "sensor.h"\n'
        "int main(void) { double r[3], c[3];\n"
        'while (scanf("%lf %lf %lf", r, r + 1, r + 2) == 3) {\n'
        f'{found.sensor}_correct(r, c); printf("%.17g %.17g %.17g\\n", c[0], c[1], c[2]); }} return 0; }}\n',
        encoding="ascii",
    )
    program = str(tmp_path / "program")
    options = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic")
    subprocess.run(["cc", *options, str(tmp_path / "main.c"), "-o", program], check=True)
    given = "\n".join(" ".join(f"{value:.17g}" for value in row) for row in readings)
    out = subprocess.run([program], input=given, capture_output=True, text=True, check=True).stdout
    assert np.array([line.split() for line in out.splitlines()], dtype=float) == pytest.approx(true, abs=1e-12)


def test_ros_corrects_as_its_node_does() -> None:
    _, true, readings = CASES[0].values
    document = yaml.safe_load(written(ACCELEROMETER, ["head"], "ros", None, None))
    corrected = np.asarray(readings) @ np.array(document["SM"]).reshape(3, 3).T - document["bias"]
    assert corrected == pytest.approx(true, abs=1e-9)


def test_the_matrix_of_kalibr_is_lower_triangular_and_changes_no_size() -> None:
    _, true, readings = CASES[0].values
    document = yaml.safe_load(written(ACCELEROMETER, ["head"], "kalibr", None, None))
    matrix = np.array(document["accelerometers"]["M"])
    assert np.triu(matrix, 1) == pytest.approx(0)
    assert np.diag(matrix).min() > 0
    force = np.linalg.solve(matrix, (np.asarray(readings) - BIAS_G * G).T).T
    assert np.linalg.norm(force, axis=1) == pytest.approx(np.linalg.norm(np.asarray(true), axis=1), abs=1e-9)
    # turned, and only turned
    assert force @ force.T == pytest.approx(np.asarray(true) @ np.asarray(true).T, abs=1e-8)


def test_what_a_format_has_not_is_refused() -> None:
    with pytest.raises(BadInput, match="this magnetometer is exported to px4, ardupilot, json, python, c"):
        written(MAGNETOMETER, [], "kalibr", None, None)
    with pytest.raises(BadInput, match="--export json takes no --instance"):
        written(MAGNETOMETER, [], "json", 1, None)
    with pytest.raises(BadInput, match="--export ros takes no --device-id"):
        written(ACCELEROMETER, [], "ros", None, 7)


def turned_by(vector: np.ndarray, sensor: str) -> Parameters:
    if sensor == "magnetometer":
        return replace(MAGNETOMETER, turned_rad=vector)
    return replace(ACCELEROMETER, gyro_turned_rad=vector)


#: Small, of any size up to half a turn, none, and those of a sensor that lies on another side: the pitch is 90 deg.
TURNS = [
    np.zeros(3), np.array([1e-9, 0.0, -2e-9]), np.radians([0.874, -0.389, -0.009]), np.array([0.0, np.pi / 2, 0.0]),
    np.array([0.0, -np.pi / 2, 0.0]), Rotation.from_euler("xyz", [40, 90, 0], degrees=True).as_rotvec(),
    np.array([np.pi, 0.0, 0.0]), *np.random.default_rng(4).uniform(-1.8, 1.8, (20, 3)),
]  # fmt: skip


@pytest.mark.parametrize(("sensor", "child"), [("accelerometer", "gyro"), ("magnetometer", "magnetometer")])
@pytest.mark.parametrize("vector", TURNS, ids=str)
def test_a_static_transform_is_the_rotation_of_scipy(sensor: str, child: str, vector: np.ndarray) -> None:
    true, found = Rotation.from_rotvec(vector), turned_by(vector, sensor)
    script = written(found, ["turned -- by hand"], "tf2", None, None).splitlines()[-1]
    words = shlex.split(script)
    options = dict(zip(words[4::2], words[5::2], strict=True))
    assert words[:4] == ["ros2", "run", "tf2_ros", "static_transform_publisher"]
    assert (options["--frame-id"], options["--child-frame-id"]) == ("accelerometer", child)
    quaternion = np.array([float(options[f"--q{name}"]) for name in "xyzw"])
    assert (Rotation.from_quat(quaternion).inv() * true).magnitude() < 1e-8
    assert np.linalg.norm(quaternion) == pytest.approx(1, abs=1e-8)
    root = ElementTree.fromstring(written(found, ["turned -- by hand"], "urdf", None, None))
    joint = root.find("joint")
    assert joint is not None
    origin, parent = joint.find("origin"), joint.find("parent")
    assert origin is not None
    assert parent is not None
    assert {each.get("name") for each in root.findall("link")} == {"accelerometer", child}
    assert (joint.get("type"), parent.get("link")) == ("fixed", "accelerometer")
    angles = [float(value) for value in str(origin.get("rpy")).split()]
    assert (Rotation.from_euler("xyz", angles).inv() * true).magnitude() < 1e-8


def test_a_transform_turns_a_vector_of_the_child_into_the_parents_axes() -> None:
    # a magnetometer turned by +90 deg about z has its x axis along the accelerometer's y axis
    found = turned_by(np.array([0.0, 0.0, np.pi / 2]), "magnetometer")
    assert isinstance(found, MagnetometerParameters)
    assert found.alignment is not None
    assert found.alignment @ [1.0, 0.0, 0.0] == pytest.approx([0.0, 1.0, 0.0], abs=1e-12)
    assert "--qz 0.707106781 --qw 0.707106781" in written(found, [], "tf2", None, None)
    assert 'rpy="0 0 1.5707963267' in written(found, [], "urdf", None, None)


@pytest.mark.parametrize("name", ["tf2", "urdf"])
def test_a_transform_without_an_alignment_is_refused_with_what_to_do(name: str) -> None:
    with pytest.raises(BadInput, match=f"--export {name}: the alignment of the gyro is unknown; calibrate by the"):
        written(ACCELEROMETER, [], name, None, None)


def test_ros_gets_the_turn_of_the_gyro_triad_and_kalibr_is_told_that_it_is_lost() -> None:
    turned = replace(ACCELEROMETER, gyro_turned_rad=np.array([0.0, 0.0, 0.02]))
    ros = written(turned, ["head"], "ros", None, None)
    assert (
        "# ros2 run tf2_ros static_transform_publisher --qx 0.000000000 --qy 0.000000000 --qz 0.009999833 "
        "--qw 0.999950000 --frame-id accelerometer --child-frame-id gyro" in ros.splitlines()
    )
    assert yaml.safe_load(ros) == yaml.safe_load(written(ACCELEROMETER, ["head"], "ros", None, None))
    assert "LOST gyroscopes" in written(turned, ["head"], "kalibr", None, None)
    assert "LOST gyro" not in written(ACCELEROMETER, ["head"], "kalibr", None, None)


def test_a_magnetometers_alignment_is_in_the_formats_of_programs(tmp_path: Path) -> None:
    turned = replace(MAGNETOMETER, turned_rad=np.array([0.1, -0.2, 0.05]))
    matrix = Rotation.from_rotvec(turned.turned_rad).as_matrix()
    reading = np.array([20.0, -11.0, 31.0])
    true = matrix @ SOFT_IRON @ (reading - HARD_IRON_UT)
    document = json.loads(written(turned, [], "json", None, None))
    field = np.array(document["matrix"]) @ (reading - document["offset"])
    assert np.array(document["alignment"]["matrix"]) @ field == pytest.approx(true, abs=1e-12)
    module: dict[str, Any] = {}
    exec(written(turned, [], "python", None, None), module)
    assert module["aligned"](reading) == pytest.approx(true, abs=1e-12)
    header = written(turned, [], "c", None, None)
    row = header.partition("magnetometer_alignment[3][3] = {{")[2].partition("}")[0]
    assert [float(value) for value in row.split(",")] == pytest.approx(matrix[0], abs=1e-15)
    assert "alignment" not in written(MAGNETOMETER, [], "json", None, None)

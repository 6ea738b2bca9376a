"""Lines of a stream: JSON and CSV, what ROS prints, and what is no reading."""

from __future__ import annotations

import json

import numpy as np
import pytest

from labctl.errors import BadInput
from labctl.recording.line_stream import LineDecoder, layout_of

HEADER = "t_s,gyro_x,gyro_y,gyro_z,accel_x_g,accel_y_g,accel_z_g"
NAMES = HEADER.split(",")


def fed(
    *lines: str, names: tuple[str, ...] = (), rate_hz: float | None = None
) -> tuple[dict[str, list[float]], int, str]:
    found = LineDecoder(names, rate_hz).feed("".join(f"{line}\n" for line in lines).encode())
    return {name: values.tolist() for name, values in found.columns.items()}, found.damaged, found.example


def test_csv_with_a_header() -> None:
    columns, damaged, _ = fed(HEADER, "10,1,2,3,0,0,1", "10.5,4,5,6,0,0.5,1")
    assert damaged == 0
    assert columns["t_s"] == [0.0, 0.5]
    assert columns["gyro_y"] == [2.0, 5.0]
    assert columns["accel_y_g"] == [0.0, 0.5]


def test_the_time_that_the_lines_state_is_kept() -> None:
    columns, _, _ = fed("time (ms)," + HEADER.partition(",")[2], "10250,1,2,3,0,0,1", "10750,4,5,6,0,0.5,1")
    assert columns["device_s"] == pytest.approx([10.25, 10.75], abs=1e-12)
    without, _, _ = fed(HEADER.partition(",")[2], "1,2,3,0,0,1", rate_hz=100.0)
    assert "device_s" not in without


def test_bytes_may_be_split_anywhere() -> None:
    data = f"{HEADER}\n10,1,2,3,0,0,1\n10.5,4,5,6,0,0.5,1\n".encode()
    decoder, times = LineDecoder(), list[float]()
    for k in range(len(data)):
        times += decoder.feed(data[k : k + 1]).columns.get("t_s", np.zeros(0)).tolist()
    assert times == [0.0, 0.5]


def test_units_of_a_header_are_converted() -> None:
    columns, _, _ = fed(
        "time (ms);gx (rad/s);gy (rad/s);gz (rad/s);ax (m/s2);ay (m/s2);az (m/s2);temp (K)",
        "5;0.1;0;0;0;0;9.80665;300", "15;0.1;0;0;0;0;9.80665;300",
    )  # fmt: skip
    assert columns["t_s"] == pytest.approx([0.0, 0.01])
    assert columns["gyro_x"] == pytest.approx([5.729578] * 2)
    assert columns["accel_z_g"] == pytest.approx([1.0] * 2)
    assert columns["temperature_c"] == pytest.approx([26.85] * 2)


def imu(nanosec: int) -> dict[str, object]:
    """Return a sensor_msgs/msg/Imu as its definition in common_interfaces has it."""
    return {
        "header": {"stamp": {"sec": 1_700_000_000, "nanosec": nanosec}, "frame_id": "imu_link"},
        "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}, "orientation_covariance": [0.0] * 9,
        "angular_velocity": {"x": 0.1, "y": 0.0, "z": -0.2}, "angular_velocity_covariance": [0.0] * 9,
        "linear_acceleration": {"x": 0.0, "y": 0.0, "z": 9.80665}, "linear_acceleration_covariance": [0.0] * 9,
    }  # fmt: skip


def flat(value: object) -> list[str]:
    if isinstance(value, dict):
        return [word for each in value.values() for word in flat(each)]
    return [word for each in value for word in flat(each)] if isinstance(value, list) else [str(value)]


@pytest.mark.parametrize("form", ["csv", "json", "rosbridge"])
def test_a_ros_topic_in_si_units(form: str) -> None:
    later = {"header": {"stamp": {"sec": 1_700_000_001, "nanosec": 9_000_000}, "frame_id": ""}}
    messages = [imu(999_000_000), imu(0) | later]
    lines = {
        "csv": [",".join(flat(each)) for each in messages],
        "json": [json.dumps(each) for each in messages],
        "rosbridge": [json.dumps({"op": "publish", "topic": "/imu", "msg": each}) for each in messages],
    }[form]
    columns, damaged, example = fed(lines[0], "---", lines[1])
    assert (damaged, example) == (0, "")
    assert columns["t_s"] == pytest.approx([0.0, 0.01], abs=1e-9)
    assert columns["gyro_z"] == pytest.approx([-11.459156] * 2)
    assert columns["accel_z_g"] == pytest.approx([1.0] * 2)


def test_lines_without_time_by_their_rate() -> None:
    names = tuple(NAMES[1:])
    columns, _, _ = fed("1,2,3,0,0,1", "1,2,3,0,0,1", names=names, rate_hz=50.0)
    assert columns["t_s"] == [0.0, 0.02]
    with pytest.raises(BadInput, match="the lines have no time; add a column t_s"):
        LineDecoder(names)
    with pytest.raises(BadInput, match="--rate 0 Hz"):
        LineDecoder(names, 0.0)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("10.1,1,2,3", "4 values where 7 are expected: '10.1,1,2,3'"),
        ("10.1,1,2,nan,0,0,1", "gyro_z is missing or no possible number"),
        ("10.1,1,2,x,0,0,1", "gyro_z is missing or no possible number"),
        ("10.1,1,2,1e9,0,0,1", "gyro_z is missing or no possible number"),
        (",1,2,3,0,0,1", "the time is missing"),
        ("9.9,1,2,3,0,0,1", "the time -0.100000 s does not follow 0.000000 s"),
        ("10,1,2,3,0,0,1", "the time 0.000000 s does not follow"),
        ('{"t_s": 10.1', "no JSON"),
        ("\x00\xff10.1,1,2,3,0", "5 values where 7 are expected"),
    ],
)
def test_a_damaged_line_is_counted_and_quoted(line: str, said: str) -> None:
    columns, damaged, example = fed(HEADER, "10,1,2,3,0,0,1", line, "10.2,1,2,3,0,0,1")
    assert columns["t_s"] == pytest.approx([0.0, 0.2])
    assert damaged == 1
    assert example.startswith(said)


def test_what_is_no_reading_by_intent_is_not_counted() -> None:
    columns, damaged, _ = fed("# a comment", "", HEADER, "10,1,2,3,0,0,1", HEADER, "", "10.2,1,2,3,0,0,1")
    assert len(columns["t_s"]) == 2
    assert damaged == 0


def test_a_line_without_end_is_given_up() -> None:
    decoder = LineDecoder()
    decoder.feed(f"{HEADER}\n".encode())
    assert decoder.feed(b"1" * 70_000).damaged == 1
    assert len(decoder.feed(b"\n1,1,2,3,0,0,1\n")) == 1


def test_a_sender_that_begins_anew_is_said() -> None:
    decoder = LineDecoder()
    decoder.feed(f"{HEADER}\n100,1,2,3,0,0,1\n".encode())
    anew = "".join(f"{k},1,2,3,0,0,1\n" for k in range(25)).encode()
    with pytest.raises(BadInput, match=r"went back from 0\.000 s to .* the sender has begun anew; start"):
        decoder.feed(anew)


@pytest.mark.parametrize(
    ("names", "said"),
    [
        (["t_s", "gyro_x", "gyro_y"], "the lines have no gyro_z, accel_x_g, accel_y_g, accel_z_g"),
        (["gx", *NAMES[2:]], "the unit of 'gx' in the lines is not known"),
        ([*NAMES, "gx_dps"], "two values of a line are gyro_x: 'gyro_x' and 'gx_dps'"),
        (["time", *NAMES[1:]], "the unit of the time 'time' in the lines is not known"),
    ],
)
def test_names_that_do_not_suffice_are_refused(names: list[str], said: str) -> None:
    with pytest.raises(BadInput, match=said):
        layout_of(names)


def test_a_first_line_of_numbers_needs_names() -> None:
    with pytest.raises(
        BadInput, match="the first line of the stream is no header: '1,2,3'; name its values with --col"
    ):
        fed("1,2,3")
    with pytest.raises(BadInput, match="the lines have no gyro_x"):
        fed('{"a": 1}')

"""Calibration files that pass a careless reader: doubled keys, odd numbers, deep nesting, no calibration at all."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError

from labctl.calibration import Calibration, hash_of, read_calibration
from labctl.compensator import Compensator
from labctl.errors import BadCalibrationFile
from labctl.exports import export_calibration
from labctl.recording import OutputUnit, Recording
from tests.helpers.calibrations import calibrated
from tests.helpers.lab import Lab
from tests.helpers.recordings import Triaxial

DEEP = 100_000


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    recording: Recording = Triaxial(1).campaign(1)
    return calibrated(recording, effects=["bias", "scale_factor"])


def hashed(document: dict[str, Any]) -> bytes:
    """Return a document under the hash that it really has."""
    return json.dumps({**document, "hash": hash_of(document)}).encode()


def doubled(calibration: Calibration, key: str, first: str) -> bytes:
    """Return the file with another value of a key before the one that the hash is of."""
    text = calibration.to_bytes().decode()
    assert text.count(f'"{key}":') >= 1
    return text.replace(f'"{key}":', f'"{key}":{first},"{key}":', 1).encode()


@pytest.mark.parametrize(
    ("key", "first"), [("version", "9"), ("axes", '["x"]'), ("serial", '"OTHER"'), ("hash", '"0"')]
)
def test_a_key_that_stands_twice_is_refused(calibration: Calibration, key: str, first: str) -> None:
    """The hash is right: it is of the last of the two. A parser that takes the first reads another calibration."""
    content = doubled(calibration, key, first)
    last = json.loads(content)
    assert hash_of(last) == last["hash"] == calibration.hash
    with pytest.raises(BadCalibrationFile, match=f"key '{key}' is repeated"):
        read_calibration(content)


def nested(text: str) -> str:
    return text.replace('"version":1', f'"version":{"[" * DEEP}{"]" * DEEP}')


def nested_tables(text: str) -> str:
    return text.replace('"version":1', f'"version":{{"a":{"[" * 900}1{"]" * 900}}}')


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (nested, "nested too deeply for a calibration"),
        (nested_tables, "nested too deeply|edited or damaged"),
        (lambda text: text.replace('"version":1', '"version":NaN'), "not JSON"),
        (lambda text: text.replace('"version":1', '"version":1e999'), "not JSON"),
        (lambda text: text.replace('"version":1', f'"version":{"1" * 5000}'), "4300 digits"),
        (lambda text: text.replace('"version":1', '"version":"\\ud800"'), "not JSON"),
        (lambda text: text + " " * (65 << 20), "larger than the limit of 67108864 bytes"),
        (
            lambda text: text.replace('"labctl-calibration/1"', json.dumps("x" * 10_000)),
            "schema 'x{79}, but this version of labctl reads",
        ),
    ],
)
def test_one_line_says_what_is_wrong(
    calibration: Calibration, tmp_path: Path, spoil: Callable[[str], str], said: str
) -> None:
    path = tmp_path / "calibration.json"
    path.write_text(spoil(calibration.to_bytes().decode()))
    with pytest.raises(BadCalibrationFile, match=said) as caught:
        Compensator.from_file(path)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 500 + len(str(path))


@pytest.mark.parametrize("part", ["model", "output", "validity", "axes"])
@pytest.mark.parametrize("value", [None, [], {}, "x", 3, [[]], {"temperature_c": 1}])
def test_what_is_no_calibration_under_a_right_hash_is_no_traceback(
    calibration: Calibration, part: str, value: Any
) -> None:
    document = {**calibration.document, part: value}
    document.pop("hash")
    for use in (Compensator.from_bytes, lambda content: export_calibration(content, "c")):
        with pytest.raises(BadCalibrationFile, match="cannot be read"):
            use(hashed(document))
    del document[part]
    with pytest.raises(BadCalibrationFile, match=f"its {part} cannot be read"):
        Compensator.from_bytes(hashed(document))


def test_what_labctl_writes_is_read_in_any_layout(calibration: Calibration) -> None:
    assert read_calibration(calibration.to_bytes()).hash == calibration.hash
    for layout in ({"indent": 2}, {"ensure_ascii": False}, {"sort_keys": True}):
        assert read_calibration(json.dumps(calibration.document, **layout).encode()).hash == calibration.hash


def test_the_command_line_ends_in_one_line(calibration: Calibration, tmp_path: Path) -> None:
    lab = Lab(tmp_path)
    (tmp_path / "in.csv").write_text("gyro_x,gyro_y,gyro_z,temperature_c\n1,2,3,25\n")
    for content in (doubled(calibration, "version", "9"), nested(calibration.to_bytes().decode()).encode()):
        (tmp_path / "calibration.json").write_bytes(content)
        found = lab.run(
            "compensate",
            str(tmp_path / "calibration.json"),
            str(tmp_path / "in.csv"),
            str(tmp_path / "out.csv"),
            status=2,
        )
        assert found.stderr.startswith("labctl: ")
        assert found.stderr.count("\n") == 1
        assert not (tmp_path / "out.csv").exists()


@pytest.mark.parametrize(
    ("unit", "is_usable"),
    [
        ({"unit": "deg/s", "offset": 0.25, "scale": 2.0}, True),
        ({"unit": "V", "offset": 1, "scale": 2}, True),
        ({"unit": "rad/s"}, True),
        ({"unit": "V", "offset": "1.5", "scale": 1.0}, True),
        ({"unit": "mV"}, False),
        ({"unit": "furlong", "offset": 0.0, "scale": 1.0}, False),
        ({"unit": ["V"], "offset": 0.0, "scale": 1.0}, False),
        ({"unit": ["V"]}, False),
        ({"unit": "V", "offset": 0.0, "scale": 0.0}, False),
        ({"unit": "V", "offset": float("inf"), "scale": 1.0}, False),
        ({"unit": "V", "offset": 0.0, "scale": 1.0, "more": 1.0}, False),
        ([0.0, 1.0], False),
        (None, False),
    ],
)
def test_a_compensator_reads_outputs_as_models_do(calibration: Calibration, unit: Any, *, is_usable: bool) -> None:
    """What is read without pydantic is what pydantic makes of it, and the rest is refused as pydantic refuses it."""
    spoilt = Calibration({**calibration.document, "output": dict.fromkeys(calibration.axes, unit)})

    if is_usable:
        model = OutputUnit.model_validate(unit)
        assert spoilt.output == dict.fromkeys(calibration.axes, (model.unit, model.offset, model.scale))
        return
    with pytest.raises(ValidationError):
        OutputUnit.model_validate(unit)
    for read in (lambda: spoilt.output, lambda: Compensator(spoilt)):
        with pytest.raises(BadCalibrationFile, match="its output cannot be read"):
            read()

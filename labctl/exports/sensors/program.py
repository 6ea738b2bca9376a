"""A sensor's calibration for programs: a JSON document, a Python module, a C99 header."""

from __future__ import annotations

import json
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from labctl.exports.comments import commented, plain
from labctl.exports.sensors.parameters import AccelerometerParameters, MagnetometerParameters, Parameters
from labctl.fitting.poses.at_rest.gravity import STANDARD_GRAVITY

SCHEMA = "labctl-sensor/1"
ALIGNED = "alignment turns what is corrected into the axes of the accelerometer that was calibrated with it"
FORMULA = "corrected = matrix (reading - offset), along x, y, z of the sensor"


def json_text(parameters: Parameters, head: Sequence[str]) -> str:
    """Return offset and matrix, with the parameters' covariance, as a JSON document."""
    response = parameters.temperature if isinstance(parameters, AccelerometerParameters) else None
    document: dict[str, object] = {
        "schema": SCHEMA, "sensor": parameters.sensor, "formula": FORMULA, "unit": parameters.unit,
        "offset": parameters.offset.tolist(), "matrix": parameters.matrix.tolist(),
        "covariance": {"of": list(parameters.labels), "values": parameters.covariance.tolist()}, "text": list(head),
    }  # fmt: skip
    if response is not None:
        document["temperature"] = {
            "formula": "offset and scale factors (diagonal of the inverse of matrix) as polynomials of T - reference_c",
            "reference_c": response.reference_c, "range_c": list(response.range_c),
            "offset_per_k": (response.bias_g * STANDARD_GRAVITY).tolist(),
            "scale_factor_per_k": response.scale_factor.tolist(),
        }  # fmt: skip
    turn = _alignment(parameters)
    if turn is not None:
        document["alignment"] = {"formula": ALIGNED, "matrix": turn.tolist()}
    return json.dumps(document, indent=2) + "\n"


def _alignment(parameters: Parameters) -> NDArray[np.float64] | None:
    return parameters.alignment if isinstance(parameters, MagnetometerParameters) else None


def _lost(parameters: Parameters) -> list[str]:
    if not isinstance(parameters, AccelerometerParameters) or parameters.temperature is None:
        return []
    return [parameters.temperature.lost(parameters.gravity_g, bias=True)]


def python_text(parameters: Parameters, head: Sequence[str]) -> str:
    """Return a module that needs nothing but Python."""
    lines = [*map(plain, head), f"{FORMULA}; offset, readings and results in {parameters.unit}.", *_lost(parameters)]
    turn = _alignment(parameters)
    lines += [] if turn is None else [f"{ALIGNED.upper()[:9]}{ALIGNED[9:]}."]
    return commented(lines) + (
        f"OFFSET = {parameters.offset.tolist()!r}\n"
        f"MATRIX = {parameters.matrix.tolist()!r}\n"
        + ("" if turn is None else f"ALIGNMENT = {turn.tolist()!r}\n")
        + "\n\n"
        "def correct(reading):\n"
        f'    """Return the corrected {parameters.sensor} reading (x, y, z), {parameters.unit}, as a list."""\n'
        "    away = [float(value) - offset for value, offset in zip(reading, OFFSET, strict=True)]\n"
        "    return [sum(factor * value for factor, value in zip(row, away)) for row in MATRIX]\n"
        + (
            ""
            if turn is None
            else (
                "\n\ndef aligned(reading):\n"
                '    """Return the corrected reading in the axes of the accelerometer, as a list."""\n'
                "    field = correct(reading)\n"
                "    return [sum(factor * value for factor, value in zip(row, field)) for row in ALIGNMENT]\n"
            )
        )
    )


def _rows(matrix: NDArray[np.float64]) -> str:
    return ", ".join("{" + ", ".join(f"{value:.17g}" for value in row) + "}" for row in matrix)


def c_text(parameters: Parameters, head: Sequence[str]) -> str:
    """Return a C99 header with one function; `#define LABCTL_REAL float` before it for single precision."""
    name = parameters.sensor
    lines = [*map(plain, head), f"{FORMULA}; offset, readings and results in {parameters.unit}.", *_lost(parameters)]
    turn = _alignment(parameters)
    lines += [] if turn is None else [f"{name}_{ALIGNED}."]
    comment = "\n * ".join(line.replace("*/", "* /") for line in lines)
    offset = ", ".join(f"{value:.17g}" for value in parameters.offset)
    return (
        f"/* {comment} */\n"
        f"#ifndef LABCTL_{name.upper()}_H\n#define LABCTL_{name.upper()}_H\n\n"
        "#ifndef LABCTL_REAL\n#define LABCTL_REAL double\n#endif\n\n"
        f"static const double {name}_offset[3] = {{{offset}}};\n"
        f"static const double {name}_matrix[3][3] = {{{_rows(parameters.matrix)}}};\n"
        + ("" if turn is None else f"static const double {name}_alignment[3][3] = {{{_rows(turn)}}};\n")
        + "\n"
        f"static inline void {name}_correct(const LABCTL_REAL *reading, LABCTL_REAL *corrected)\n"
        "{\n"
        "    LABCTL_REAL away[3];\n"
        "    int i, j;\n"
        f"    for (i = 0; i < 3; i++) away[i] = reading[i] - (LABCTL_REAL){name}_offset[i];\n"
        "    for (i = 0; i < 3; i++) {\n"
        "        corrected[i] = 0;\n"
        f"        for (j = 0; j < 3; j++) corrected[i] += (LABCTL_REAL){name}_matrix[i][j] * away[j];\n"
        "    }\n"
        "}\n\n#endif\n"
    )

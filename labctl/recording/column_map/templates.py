"""Templates: a CSV file for each kind of data, with the columns that it needs and units in their names."""

from __future__ import annotations

from typing import get_args

from labctl.answers.recording_head import Motion
from labctl.errors import BadInput

_GYRO = ("gyro_x (deg/s)", "gyro_y (deg/s)", "gyro_z (deg/s)")
_ACCEL = ("accel_x (g)", "accel_y (g)", "accel_z (g)")
_AT_REST = ("0.12", "-0.05", "0.31")
_UP = ("0.002", "-0.011", "0.998")

_TEMPLATES: dict[Motion, tuple[tuple[str, ...], tuple[tuple[str, ...], ...]]] = {
    "rest": (
        ("t (s)", *_GYRO, "temperature (degC)"),
        (("0.00", *_AT_REST, "21.4"), ("0.01", "0.10", "-0.06", "0.30", "21.4"), ("0.02", *_AT_REST, "21.4")),
    ),
    "rates": (
        ("data set", "t (s)", "position", "table rate (deg/s)", *_GYRO, "temperature (degC)"),
        (
            ("1", "0.00", "z", "0", *_AT_REST, "21.4"),
            ("1", "0.01", "z", "0", *_AT_REST, "21.4"),
            ("2", "9.00", "z", "50", "0.15", "-0.21", "50.42", "21.5"),
            ("2", "9.01", "z", "50", "0.14", "-0.20", "50.40", "21.5"),
        ),
    ),
    "turns": (
        ("data set", "t (s)", "position", "turn_deg", "turn_u_deg", *_GYRO),
        (
            ("1", "0.00", "z", "360", "1", "0.4", "-0.3", "88.2"),
            ("1", "0.01", "z", "360", "1", "0.4", "-0.3", "88.9"),
            ("2", "9.00", "z", "-360", "1", "-0.4", "0.2", "-91.0"),
            ("2", "9.01", "z", "-360", "1", "-0.4", "0.2", "-91.3"),
        ),
    ),
    "profile": (
        ("t (s)", "position", "table rate (deg/s)", *_GYRO),
        (
            ("0.00", "z", "0.0", *_AT_REST),
            ("0.01", "z", "0.5", "0.12", "-0.05", "0.80"),
            ("0.02", "z", "1.0", "0.13", "-0.06", "1.32"),
        ),
    ),
    "poses": (
        ("t (s)", *_GYRO, *_ACCEL, "temperature (degC)"),
        (("0.00", *_AT_REST, *_UP, "21.4"), ("0.01", *_AT_REST, *_UP, "21.4"), ("0.02", *_AT_REST, *_UP, "21.4")),
    ),
}  # fmt: skip
KINDS: tuple[Motion, ...] = get_args(Motion)


def template(kind: str) -> str:
    """Return the template of a kind of data as CSV; raises BadInput for an unknown kind."""
    for motion, (header, rows) in _TEMPLATES.items():
        if motion == kind:
            return "".join(",".join(row) + "\n" for row in (header, *rows))
    raise BadInput(f"--template {kind[:40]}: choose one of {', '.join(KINDS)}")

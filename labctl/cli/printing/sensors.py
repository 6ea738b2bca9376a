"""Prints calibrations of accelerometers and magnetometers, and their versions."""

from __future__ import annotations

from collections.abc import Sequence

from labctl.cli.output import console, format_number, table
from labctl.services.schemas.reports.accelerometer import AccelerometerResponse
from labctl.services.schemas.reports.magnetometer import MagnetometerResponse
from labctl.services.schemas.sensors import AccelerometerVersion, MagnetometerVersion, SensorVersionResponse


def print_sensor(answer: AccelerometerResponse | MagnetometerResponse) -> None:
    """Print the parameters with their uncertainty, the verdict and what it stands on."""
    if isinstance(answer, AccelerometerResponse):
        _print_accelerometer(answer)
    else:
        _print_magnetometer(answer)


def print_kept(answer: AccelerometerVersion | MagnetometerVersion) -> None:
    """Print a version that was kept: its parameters, who and when, and its data."""
    print_sensor(answer.result)
    files = ", ".join(f"{file.name} ({file.sha256[:12]})" for file in answer.data.files)
    console.print(
        f"{answer.sensor} of {answer.serial}, version {answer.version}: stored {answer.at:%Y-%m-%d %H:%M} UTC by "
        f"{answer.by}; hash {answer.hash[:12]}",
        markup=False, soft_wrap=True,
    )  # fmt: skip
    console.print(f"data: {files}; {answer.data.read_as}", markup=False, soft_wrap=True, style="dim")


def print_versions(answers: Sequence[SensorVersionResponse]) -> None:
    """Print the versions of a unit's sensors."""
    rows = table("accelerometer and magnetometer", "sensor", "version", "verdict", "stored, UTC", "by", "files", "hash")
    for answer in answers:
        rows.add_row(
            answer.sensor, str(answer.version), answer.verdict, f"{answer.at:%Y-%m-%d %H:%M}", answer.by,
            str(len(answer.data.files)), answer.hash[:12],
        )  # fmt: skip
    console.print(rows)


def _print_accelerometer(answer: AccelerometerResponse) -> None:
    rows = table("accelerometer", "coefficient", "unit", "value", "u", numbers=2)
    for name, unit, values in (
        ("bias", "g", answer.bias_g),
        ("scale factor", "1", answer.scale_factor),
        ("misalignment", "1", answer.misalignment),
    ):
        for place, value in values.items():
            rows.add_row(f"{name} {place}", unit, format_number(value.value, 5), format_number(value.u, 2))
    if answer.temperature is not None:
        for name, unit, terms in (("bias", "g", answer.temperature.bias_g),
                                  ("scale factor", "1", answer.temperature.scale_factor)):  # fmt: skip
            for axis, found_terms in terms.items():
                for power, value in enumerate(found_terms, start=1):
                    per = f"{unit}/K" + (f"^{power}" if power > 1 else "")
                    rows.add_row(f"{name} {axis}", per, format_number(value.value, 3), format_number(value.u, 2))
    console.print(rows)
    _print_verdict(answer)
    density = max(answer.noise_density_m_s2.values())
    console.print(
        f"{answer.rests - answer.left_out} of {answer.rests} rests used, in {answer.poses} poses; white noise up to "
        f"{density:.2g} m/s2/sqrt(Hz)",
        style="dim",
    )


def _print_magnetometer(answer: MagnetometerResponse) -> None:
    rows = table("magnetometer", "coefficient", "unit", "value", "u", numbers=2)
    for axis, value in answer.hard_iron_ut.items():
        rows.add_row(f"hard iron {axis}", "uT", format_number(value.value), format_number(value.u, 2))
    for place, value in answer.soft_iron.items():
        rows.add_row(f"soft iron {place}", "1", format_number(value.value, 5), format_number(value.u, 2))
    rows.add_row("field", "uT", format_number(answer.field_ut.value), format_number(answer.field_ut.u, 2))
    console.print(rows)
    _print_verdict(answer)
    console.print(
        f"{answer.readings - answer.left_out} of {answer.readings} readings used; from any direction to the nearest "
        f"measured one: up to {answer.largest_gap_deg:.0f} deg",
        style="dim",
    )


def _print_verdict(answer: AccelerometerResponse | MagnetometerResponse) -> None:
    console.print(f"verdict: {answer.verdict}", style="green" if answer.verdict == "adequate" else "bold red")
    for line in answer.text:
        console.print(line, soft_wrap=True, markup=False)

"""Prints calibrations of accelerometers and magnetometers, and their versions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from labctl.cli.output import console, format_number, table
from labctl.shown_unit import shown_unit

if TYPE_CHECKING:
    from labctl.answers.accelerometer import AccelerometerResponse
    from labctl.answers.magnetometer import MagnetometerResponse
    from labctl.answers.sensors import AccelerometerVersion, MagnetometerVersion, SensorVersionResponse


def print_sensor(answer: AccelerometerResponse | MagnetometerResponse) -> None:
    """Print the parameters with their uncertainty, the verdict and what it stands on."""
    from labctl.answers.accelerometer import AccelerometerResponse
    from labctl.services.sensor_coefficients import coefficients_of

    name = "accelerometer" if isinstance(answer, AccelerometerResponse) else "magnetometer"
    rows = table(name, "coefficient", "unit", "value", "u", "U, 95.45 %", numbers=2)
    for each in coefficients_of(answer):
        factor, unit_symbol = shown_unit(each.unit, each.name)
        known = (each.value, each.u, each.expanded)
        shown = [None if value is None else factor * value for value in known]
        rows.add_row(each.name, unit_symbol, *map(format_number, shown, (5, 2, 2)))
    console.print(rows)
    _print_verdict(answer)
    _print_extent(answer)


def print_kept(answer: AccelerometerVersion | MagnetometerVersion) -> None:
    """Print a version that was kept: its parameters, who and when, and its data."""
    print_sensor(answer.result)
    files = ", ".join(f"{each.name} ({each.sha256[:12]})" for each in answer.data.files)
    console.print(
        f"{answer.sensor} of {answer.serial}, version {answer.version}: stored {answer.at:%Y-%m-%d %H:%M} UTC by "
        f"{answer.by}; hash {answer.hash[:12]}",
        markup=False, soft_wrap=True,
    )  # fmt: skip
    console.print(f"data: {files}; {answer.data.read_as}", markup=False, soft_wrap=True, style="dim")


def print_versions(answers: Sequence[SensorVersionResponse]) -> None:
    """Print the versions of a unit's sensors."""
    rows = table("accelerometer and magnetometer", "sensor", "version", "verdict", "stored, UTC", "by", "files", "hash")
    for each in answers:
        rows.add_row(
            each.sensor, str(each.version), each.verdict, f"{each.at:%Y-%m-%d %H:%M}", each.by,
            str(len(each.data.files)), each.hash[:12],
        )  # fmt: skip
    console.print(rows)


def _print_extent(answer: AccelerometerResponse | MagnetometerResponse) -> None:
    """Print how many data the result stands on."""
    from labctl.answers.accelerometer import AccelerometerResponse

    if isinstance(answer, AccelerometerResponse):
        density = max(answer.noise_density_m_s2.values())
        extent = (
            f"{answer.rests - answer.left_out} of {answer.rests} rests used, in {answer.poses} poses; white noise up "
            f"to {density:.2g} m/s2/sqrt(Hz)"
        )
    else:
        extent = (
            f"{answer.readings - answer.left_out} of {answer.readings} readings used; from any direction to the "
            f"nearest measured one: up to {answer.largest_gap_deg:.0f} deg"
        )
    console.print(extent, style="dim")


def _print_verdict(answer: AccelerometerResponse | MagnetometerResponse) -> None:
    console.print(f"verdict: {answer.verdict}", style="green" if answer.verdict == "adequate" else "bold red")
    for line in answer.text:
        console.print(line, soft_wrap=True, markup=False)

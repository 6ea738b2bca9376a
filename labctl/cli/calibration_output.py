"""Fits and coefficients as text."""

from __future__ import annotations

from typing import TYPE_CHECKING

from labctl.cli.output import console, format_number, table

if TYPE_CHECKING:
    from labctl.services.schemas.calibrations import FitResponse


def print_fit(answer: FitResponse) -> None:
    """Print a fit for a person: the errors first, then the coefficients."""
    error = answer.error
    console.print(f"[bold]{answer.serial}[/] version {answer.version}: {answer.model.name}")
    console.print(f"  before             {format_number(error.raw_rms_dps)} deg/s RMS")
    console.print(f"  after              {format_number(error.rms_dps)} deg/s RMS")
    console.print(f"  held-out           {format_number(error.heldout_rms_dps)} deg/s RMS")
    console.print(f"  noise floor        {format_number(error.noise_floor_dps)} deg/s")
    low, high = answer.validity.temperature_c
    slow, fast = answer.validity.rate_dps
    console.print(f"  valid              {low:.1f} to {high:.1f} deg C, {slow:.4g} to {fast:.4g} deg/s")
    for axis, content in answer.axes.items():
        coefficients = content["coefficients"]
        if "temperature_c" in coefficients:
            console.print(f"\n[bold]axis {axis}[/]: a table over {len(coefficients['temperature_c'])} temperatures")
            print_table(coefficients)
            continue
        rows = table(f"axis {axis}", "coefficient", "unit", "value", "u", numbers=2)
        for name, entry in coefficients.items():
            rows.add_row(name, entry["unit"], format_number(entry["value"], 6), format_number(entry["u"], 2))
        console.print(rows)


def print_table(coefficients: dict[str, object]) -> None:
    """Print a coefficient table over temperature, one row per temperature."""
    names = [name for name in coefficients if name != "temperature_c"]
    nodes: list[float] = coefficients["temperature_c"]  # type: ignore[assignment]
    rows = table("", "deg C", *names, numbers=len(names) + 1)
    for index, node in enumerate(nodes):
        values = [coefficients[name]["value"][index] for name in names]  # type: ignore[index]
        rows.add_row(f"{node:.2f}", *(format_number(value, 5) for value in values))
    console.print(rows)

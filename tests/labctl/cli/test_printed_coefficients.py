"""Coefficients in tables of commands: the value to the place of its U, large numbers without an exponent."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from labctl.cli.output import console
from labctl.cli.printing.fleet import print_report
from labctl.cli.printing.uncertainty import _print_coefficients


def test_the_mean_of_a_type_is_rounded_to_its_uncertainty() -> None:
    due = SimpleNamespace(overdue=0, within_30_days=0, within_90_days=0, later=0, no_date=0, none_in_force=26)
    figures = SimpleNamespace(type="FOG-A", units=26, error_over_floor=[], verdicts={}, missing={}, due=due)
    coefficients = [
        SimpleNamespace(
            name="x.bias", unit="deg/s", mean=-0.00217, expanded_u_mean=0.0069, spread=0.0165, median_u=6.5e-4
        ),
        SimpleNamespace(
            name="x.scale_factor", unit="1", mean=1.0184e-3, expanded_u_mean=7.5e-4, spread=1.813e-3, median_u=5.9e-6
        ),
    ]
    answer: Any = SimpleNamespace(figures=figures, coefficients=coefficients, outliers=[], text=[])
    with console.capture() as captured:
        print_report(answer)
    lines = [line.split() for line in captured.get().splitlines()]
    assert ["x.bias", "deg/s", "-0.0022", "0.0069", "0.0165", "0.00065"] in lines
    assert ["x.scale_factor", "ppm", "1020", "750", "1810", "5.9"] in lines


def test_a_coefficient_is_rounded_to_its_uncertainty() -> None:
    lines: list[dict[str, object]] = [{"source": "clock", "contribution": 4.6e-6}]
    one = {"unit": "1", "value": 370.9e-6, "combined": 2.16e-4, "k": 2.0, "expanded": 4.32e-4, "lines": lines}
    answer: Any = SimpleNamespace(temperature_c=25.0, coefficients={"x": {"scale_factor": one}})
    with console.capture() as captured:
        _print_coefficients(answer)
    row = next(line.split() for line in captured.get().splitlines() if "scale_factor" in line)
    assert row == ["x", "scale_factor", "ppm", "370", "220", "2", "430", "4.6"]

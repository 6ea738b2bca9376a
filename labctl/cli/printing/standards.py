"""Reference standards, check gyros and comparisons as text."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from labctl.cli.output import console, format_number, table

if TYPE_CHECKING:
    from labctl.answers.standards import AffectedResponse, ChartLimits, DriftPrediction, StandardResponse
    from labctl.answers.validity import CheckGyroResponse, LaboratoryComparison


def print_list(answers: Sequence[StandardResponse]) -> None:
    """Print one line for each standard, then what is to be done."""
    if not answers:
        console.print("the register holds no standard; `labctl standards add` adds one", markup=False)
        return
    rows = table("", "standard", "quantity", "state", "due", "certificate", "u now", "drift per year")
    for answer in answers:
        newest = answer.certificates[-1].number if answer.certificates else "–"
        largest = max(answer.predictions, key=lambda prediction: prediction.u, default=None)
        rows.add_row(
            answer.label, answer.quantity, answer.state, str(answer.due or "–"), newest,
            "–" if largest is None else f"{largest.u:.3g} {answer.unit}", "–" if largest is None else _drift(largest),
        )  # fmt: skip
    console.print(rows)
    _print_text([text for answer in answers for text in answer.text])


def print_standard(answer: StandardResponse) -> None:
    """Print a standard with its certificates, predictions, checks and findings."""
    serial = f", serial number {answer.serial}" if answer.serial else ""
    console.print(f"{answer.label}: {answer.quantity} in {answer.unit}{serial}; {answer.state}", markup=False)
    if answer.certificates:
        rows = table("certificates", "number", "laboratory", "calibrated", "due", "nominal", "error", "u", numbers=3)
        for certificate in answer.certificates:
            for point in certificate.points:
                rows.add_row(
                    certificate.number, certificate.laboratory, str(certificate.calibrated),
                    str(certificate.due or "–"),
                    format_number(point.nominal), format_number(point.value), format_number(point.u, 3),
                )  # fmt: skip
        console.print(rows)
    for prediction in answer.predictions:
        place_text = "" if prediction.nominal is None else f" at {prediction.nominal:g}"
        drift = _drift(prediction) if prediction.per_year is None else f"drift per year {_drift(prediction)}"
        value = "not stated" if prediction.value is None else f"{prediction.value:.4g}"
        console.print(
            f"on {prediction.on}{place_text}: error {value}, u = {prediction.u:.3g} {answer.unit}; {drift}",
            markup=False,
            soft_wrap=True,
        )
    if answer.checks:
        rows = table("intermediate checks", "time", "by", "state", "limits", "nominal", "value", "u", numbers=3)
        for check in answer.checks:
            rows.add_row(
                f"{check.checked_at:%Y-%m-%d %H:%M}", check.by, check.state, _limits(check.limits),
                format_number(check.nominal), format_number(check.value), format_number(check.u, 3),
            )  # fmt: skip
        console.print(rows)
    for finding in answer.findings:
        until = finding.bad_until or "now"
        withdrawn = f"; withdrawn: {finding.withdrawn}" if finding.withdrawn else ""
        text = f"finding {finding.number}: bad from {finding.bad_from} until {until}: {finding.reason}{withdrawn}"
        console.print(text, markup=False, soft_wrap=True)
    _print_text(answer.text)


def _drift(prediction: DriftPrediction) -> str:
    if prediction.per_year is None or prediction.u_per_year is None:
        return prediction.why or "unknown"
    return f"{prediction.per_year:.3g} (u {prediction.u_per_year:.2g})"


def _limits(limits: Sequence[ChartLimits]) -> str:
    return "; ".join(f"{limit.basis}: {limit.low:.4g} to {limit.high:.4g}" for limit in limits) or "–"


def print_affected(answer: AffectedResponse) -> None:
    """Print the calibrations that a standard was used for."""
    if answer.calibrations:
        rows = table("", "unit", "version", "campaigns", "measured", "in force", "certificates")
        for calibration in answer.calibrations:
            measured = f"{calibration.performed_from} to {calibration.performed_until}"
            rows.add_row(
                calibration.serial, str(calibration.version), ", ".join(map(str, calibration.campaigns)) or "imported",
                measured if calibration.performed_from else "date not known",
                "in force" if calibration.in_force else "",
                ", ".join(calibration.certificates) or "–",
            )  # fmt: skip
        console.print(rows)
    _print_text(answer.text)


def print_check_gyro(answer: CheckGyroResponse) -> None:
    """Print the control charts of a check gyro."""
    for chart in answer.charts:
        at = f" at {answer.temperature_c:g} deg C" if chart.result == "bias" else ""
        title = f"{chart.result} of axis {chart.axis}{at}, {chart.unit}"
        rows = table(title, "date", "campaign", "version", "state", "limits", "value", "u", numbers=2)
        for point in chart.points:
            rows.add_row(
                f"{point.at:%Y-%m-%d}", "imported" if point.campaign is None else str(point.campaign),
                str(point.version), point.state, _limits(point.limits), format_number(point.value, 6),
                format_number(point.u, 3),
            )  # fmt: skip
        console.print(rows)
    for recording, reason in answer.left_out.items():
        console.print(f"recording {recording} is not on the charts: {reason}", markup=False, soft_wrap=True)
    if not answer.marked:
        console.print(f"{answer.serial} is no check gyro; --mark makes it one", markup=False)
    _print_text(answer.text)


def print_comparison(answer: LaboratoryComparison) -> None:
    """Print two calibrations compared."""
    for name, side in (("first", answer.first), ("second", answer.second)):
        place_text = ", ".join(filter(None, (side.laboratory, side.bench))) or "imported"
        day = side.measured_on or "a date that is not known"
        text = f"{name}: {side.serial} version {side.version}, {place_text}, measured on {day}"
        console.print(text, markup=False)
    title = f"at {answer.temperature_c:g} deg C"
    rows = table(title, "axis", "result", "unit", "first", "U", "second", "U", "En", "zeta", numbers=6)
    for result in answer.results:
        rows.add_row(
            result.axis, result.result, result.unit, f"{result.values[0]:.6g}", f"{result.expanded[0]:.2g}",
            f"{result.values[1]:.6g}", f"{result.expanded[1]:.2g}", f"{result.en:.2f}", f"{result.zeta:.2f}",
        )  # fmt: skip
    console.print(rows)
    for quantity, reason in answer.not_compared.items():
        console.print(f"not compared: {quantity}: {reason}", markup=False, soft_wrap=True)
    _print_text(answer.text)


def _print_text(text: Sequence[str]) -> None:
    for line in text:
        console.print(line, markup=False, soft_wrap=True)

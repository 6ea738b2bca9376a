"""What a certificate states of the item's accelerometer and magnetometer: versions that the order names.

The reference is a common scale: gravity by which a force is known, or the field. The coefficients are converted exactly
to the value that the order states, and its uncertainty is a line of their budgets.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from labctl.answers.accelerometer import AccelerometerResponse, AccelerometerTemperature
from labctl.answers.certificates import CertificateOrder, OrderedAccelerometer, OrderedMagnetometer, OrderedSensor
from labctl.answers.poses import AccelerometerCoefficient
from labctl.answers.sensors import AccelerometerVersion, MagnetometerVersion, SensorName
from labctl.certificates.document import SensorCoefficient, SensorReference, SensorResult
from labctl.errors import BadInput
from labctl.fitting.magnetometer.calibrate import AXES
from labctl.fitting.magnetometer.ellipsoid import PARAMETERS, PLACES
from labctl.fitting.poses.at_rest.accelerometer import PARAMETERS as ACCELEROMETER_PARAMETERS
from labctl.fitting.poses.at_rest.gravity import STANDARD_GRAVITY
from labctl.fitting.poses.triad import UPPER
from labctl.fitting.uncertainty.budget import BudgetLine, budget_of
from labctl.services.certificates.missing import MissingFact
from labctl.services.sensor_versions import one_accelerometer, one_magnetometer
from labctl.store import Store

#: Parameters of an accelerometer that an earlier version has given, where it was used too.
KNOWN_BEFORE = 6
FORCE = "reading = bias + (1 + E) force; E: scale factors on the diagonal, misalignment ij of axis i by force along j"
ALIGNED = (
    "gyro triad about each axis: rotation vector from the frame of the accelerometer to that of the gyro, each frame "
    "the nearest orthonormal one to the axes of its triad"
)
FIELD_ALIGNED = (
    "magnetometer about each axis: rotation vector from the axes of the corrected force and rate of this item to those "
    "of the corrected field"
)
FIELD = "field = soft iron (reading - hard iron); soft iron symmetric, in the axes of the sensor"
NOT_FORCE = (
    "Not measured, and not stated: other temperatures, larger forces, nonlinearity, vibration, and the change from one "
    "power-on to the next or with time."
)
NOT_FORCE_WARM = NOT_FORCE.replace("other temperatures", "temperatures outside the range")
NOT_FIELD = (
    "Not measured, and not stated: other temperatures, iron and currents that come near later, change with time."
)
NO_FIELD = "none: the soft iron is relative to this size, the hard iron in the nominal unit of the readings"


@dataclass(frozen=True)
class Sensors:
    """The versions that an order names."""

    accelerometer: AccelerometerVersion | None = None
    magnetometer: MagnetometerVersion | None = None

    @staticmethod
    def of(store: Store, serial: str, order: CertificateOrder) -> Sensors:
        """Return the versions that an order names. Raises NotFound."""
        force, field = order.accelerometer, order.magnetometer
        return Sensors(
            None if force is None else one_accelerometer(store, serial, force.version),
            None if field is None else one_magnetometer(store, serial, field.version),
        )

    def results(self, order: CertificateOrder, included_by: str) -> Iterator[SensorResult]:
        """Yield what the certificate states of each."""
        if self.accelerometer is not None and order.accelerometer is not None:
            yield accelerometer_result(self.accelerometer, order.accelerometer, included_by)
        if self.magnetometer is not None and order.magnetometer is not None:
            yield magnetometer_result(self.magnetometer, order.magnetometer, included_by)


def missing_of(order: CertificateOrder) -> Iterator[MissingFact]:
    """Yield the mandatory facts of the named versions that the order does not state. Raises BadInput for wrong ones."""
    force, field = order.accelerometer, order.magnetometer
    if force is not None:
        yield from _missing_day(force, "accelerometer")
        for name, value in (
            ("local gravity (gravity_m_s2)", force.gravity_m_s2),
            ("standard uncertainty of the local gravity (gravity_u_m_s2)", force.gravity_u_m_s2),
            ("traceability of the local gravity", force.traceability.strip()),
        ):
            if not value:
                yield MissingFact(name, "[accelerometer] of the order", "accelerometer")
    if field is not None:
        yield from _missing_day(field, "magnetometer")
        stated = (field.field_ut, field.field_u_ut, field.traceability.strip())
        if any(stated) and not all(stated):
            yield MissingFact(
                "field_ut, field_u_ut and traceability together",
                "[magnetometer] of the order, or none of the three",
                "magnetometer",
            )


def _missing_day(sensor: OrderedSensor, name: Literal["accelerometer", "magnetometer"]) -> Iterator[MissingFact]:
    where = f"[{name}] of the order"
    if sensor.performed_from is None:
        yield MissingFact(f"performed_from of the {name}", where, name)
    elif sensor.performed_until is not None and sensor.performed_until < sensor.performed_from:
        raise BadInput(
            f"{where}: performed_until = {sensor.performed_until} is before performed_from = {sensor.performed_from}; "
            "correct the dates"
        )


def accelerometer_result(
    version: AccelerometerVersion, ordered: OrderedAccelerometer, included_by: str
) -> SensorResult:
    """Return an accelerometer's result, its scale factors those of the stated gravity."""
    result = version.result
    if ordered.gravity_m_s2 is None or ordered.gravity_u_m_s2 is None:
        raise BadInput("[accelerometer] of the order: state gravity_m_s2 and gravity_u_m_s2")  # refused before
    used = result.gravity_g * STANDARD_GRAVITY
    ratio, relative_u = used / ordered.gravity_m_s2, ordered.gravity_u_m_s2 / ordered.gravity_m_s2
    freedom = _freedom_of(result)
    u = np.sqrt(np.diag(np.array(result.covariance)))
    coefficients = [
        _coefficient(f"bias {axis}", STANDARD_GRAVITY * result.bias_g[axis].value, "m/s^2", (STANDARD_GRAVITY * u[i],
                     result.bias_g[axis].degrees_of_freedom or freedom), 0.0)
        for i, axis in enumerate(AXES)
    ]  # fmt: skip
    for place, (i, j) in enumerate(UPPER, start=len(AXES)):
        name, identity = AXES[i] + AXES[j], float(i == j)
        was = result.scale_factor[AXES[i]] if i == j else result.misalignment[name]
        value = ratio * (identity + was.value) - identity
        named = f"scale factor {AXES[i]}" if i == j else f"misalignment {name}"
        fit = ratio * u[place], was.degrees_of_freedom or freedom
        coefficients.append(_coefficient(named, value, "1", fit, (identity + value) * relative_u))
    coefficients += [] if result.alignment is None else _aligned("gyro triad", result.alignment["axes"])
    coefficients += [] if result.temperature is None else _over_temperature(result.temperature, ratio, freedom)
    reference = SensorReference(
        quantity="local gravity", value=ordered.gravity_m_s2, u=ordered.gravity_u_m_s2, unit="m/s^2",
        traceability=ordered.traceability.strip(),
    )  # fmt: skip
    temperature_text = "" if result.temperature is None else (
        f" from {result.temperature.range_c[0]:.1f} °C to {result.temperature.range_c[1]:.1f} °C, the coefficients "
        f"without a power those at {result.temperature.reference_c:g} °C,"
    )  # fmt: skip
    holds_for = (
        f"Specific forces of the size of gravity in any direction,{temperature_text} at the conditions of the "
        f"{result.rests - result.left_out} rests in {result.poses} poses."
    )
    converted = (
        f"The fit took the local gravity as {used:.7g} m/s²; the coefficients here are for that of the reference."
    )
    formula = FORCE if result.alignment is None else f"{FORCE}; {ALIGNED}"
    notes = (formula, holds_for, NOT_FORCE if result.temperature is None else NOT_FORCE_WARM)
    return _result("accelerometer", version, ordered, included_by, reference, coefficients, notes, [converted])


def _aligned(what: str, axes: Mapping[str, AccelerometerCoefficient]) -> list[SensorCoefficient]:
    """Return a rotation; the sizes of gravity and field have no part in it.

    Without degrees of freedom its standard uncertainty is that of a t distribution already, and U is twice as much.
    """
    return [
        _coefficient(
            f"{what} about {axis}", each["value"], each["unit"], (each["u"], each.get("degrees_of_freedom")), 0.0
        )
        for axis, each in axes.items()
    ]


def _over_temperature(law: AccelerometerTemperature, ratio: float, freedom: float) -> list[SensorCoefficient]:
    """Return the coefficients of temperature; the uncertainty of gravity is too small a share of them to count."""
    coefficients = []
    u = iter(np.sqrt(np.diag(np.array(law.covariance)))[ACCELEROMETER_PARAMETERS:].tolist())
    for name, unit_symbol, terms, factor in (
        ("bias", "m/s^2", law.bias_g, STANDARD_GRAVITY), ("scale factor", "1", law.scale_factor, ratio)
    ):  # fmt: skip
        for power in range(1, len(terms[AXES[0]]) + 1):
            per = f"{unit_symbol}/K" + (f"^{power}" if power > 1 else "")
            for axis in AXES:
                was = terms[axis][power - 1]
                fit = factor * next(u), was.degrees_of_freedom or freedom
                named = f"{name} {axis}, power {power} of temperature"
                coefficients.append(_coefficient(named, factor * was.value, per, fit, 0.0))
    return coefficients


def magnetometer_result(version: MagnetometerVersion, ordered: OrderedMagnetometer, included_by: str) -> SensorResult:
    """Return a magnetometer's result: its soft iron that of the stated field, or relative where none is stated.

    Raises BadInput for one whose field was not constant.
    """
    result = version.result
    if version.verdict != "adequate":
        raise BadInput(
            f"[magnetometer] of the order: the field of version {version.version} was not constant, and its "
            "coefficients are no calibration; record it again, or leave [magnetometer] out"
        )
    covariance, used = np.array(result.covariance), result.field_ut.value
    stated, u_stated = ordered.field_ut, ordered.field_u_ut
    ratio = 1.0 if stated is None else stated / used
    freedom = max((result.readings - result.left_out) / result.repetition - PARAMETERS, 1.0)
    coefficients = [
        _coefficient(f"hard iron {axis}", result.hard_iron_ut[axis].value, "uT", (math.sqrt(covariance[i, i]),
                     result.hard_iron_ut[axis].degrees_of_freedom or freedom), 0.0)
        for i, axis in enumerate(AXES)
    ]  # fmt: skip
    for place, (i, j) in enumerate(PLACES, start=len(AXES)):
        was = result.soft_iron[AXES[i] + AXES[j]]
        value = ratio * was.value
        by = np.zeros(len(covariance))
        by[place] = ratio
        if stated is not None:  # the stated size replaces the one by the readings, with its uncertainty
            by[-1] = -value / used
        of_fit = math.sqrt(max(float(by @ covariance @ by), 0.0))
        of_field = 0.0 if stated is None or u_stated is None else value * u_stated / stated
        coefficients.append(
            _coefficient(
                f"soft iron {AXES[i]}{AXES[j]}", value, "1", (of_fit, was.degrees_of_freedom or freedom), of_field
            )
        )
    coefficients += [] if result.alignment is None else _aligned("magnetometer", result.alignment["axes"])
    reference = SensorReference(
        quantity="size of the local field", value=used if stated is None else stated, unit="uT",
        u=None if stated is None else u_stated,
        traceability=NO_FIELD if stated is None else ordered.traceability.strip(),
    )  # fmt: skip
    holds_for = (
        "The item as it was mounted, with the iron and the currents near it; from any direction of the field to the "
        f"nearest that was measured: up to {result.largest_gap_deg:.0f}°."
    )
    formula = FIELD if result.alignment is None else f"{FIELD}; {FIELD_ALIGNED}"
    return _result(
        "magnetometer", version, ordered, included_by, reference, coefficients, (formula, holds_for, NOT_FIELD)
    )


def _freedom_of(result: AccelerometerResponse) -> float:
    """Return the degrees of freedom of a fit that states none: rests beyond what the parameters take."""
    known = KNOWN_BEFORE if result.earlier is not None else 0
    law = result.temperature
    parameters = ACCELEROMETER_PARAMETERS if law is None else len(law.covariance)
    return max(float(result.rests - result.left_out + known - parameters), 1.0)


def _coefficient(
    name: str, value: float, unit_symbol: str, of_fit: tuple[float, float | None], of_reference: float
) -> SensorCoefficient:
    """Return a coefficient with U: `of_fit` is the standard uncertainty of the fit, and its degrees of freedom."""
    u, freedom = of_fit
    lines = [BudgetLine("coefficients", "fit", "A", "normal", u, unit_symbol, 1.0, u, freedom)]
    if of_reference:
        size = abs(of_reference)
        lines.append(BudgetLine("reference", "reference", "B", "normal", size, unit_symbol, 1.0, size, is_common=True))
    budget = budget_of(name, unit_symbol, lines, value)
    combined, expanded, k = budget.combined or 0.0, budget.expanded or 0.0, budget.k or 0.0  # every line is known
    return SensorCoefficient(name=name, value=value, u=combined, expanded=expanded, k=k, unit=unit_symbol)


def _result(
    sensor: SensorName, version: AccelerometerVersion | MagnetometerVersion, ordered: OrderedSensor, included_by: str,
    reference: SensorReference, coefficients: Sequence[SensorCoefficient], notes: tuple[str, str, str],
    findings: Sequence[str] = (),
) -> SensorResult:  # fmt: skip
    formula, holds_for, not_stated = notes
    first = ordered.performed_from
    if first is None:
        raise BadInput(f"[{sensor}] of the order: state performed_from")  # refused before
    return SensorResult(
        sensor=sensor, version=version.version, hash=version.hash,
        files=tuple(f"{each.name} ({each.sha256})" for each in version.data.files),
        performed_from=first, performed_until=ordered.performed_until or first, included_by=included_by,
        formula=formula, reference=reference, coefficients=tuple(coefficients), verdict=version.verdict,
        found=(*version.summary, *findings), holds_for=holds_for, not_stated=not_stated,
    )  # fmt: skip

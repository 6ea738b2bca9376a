"""The coefficients of an accelerometer, a magnetometer and their alignment as one list: what is printed and shown."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from labctl.answers.accelerometer import AccelerometerResponse, AccelerometerTemperature
from labctl.answers.magnetometer import Estimate, MagnetometerResponse
from labctl.answers.poses import AccelerometerCoefficient
from labctl.answers.sensors import SensorCoefficientResponse
from labctl.fitting.numeric.degrees_of_freedom import student_factor


def coefficients_of(answer: AccelerometerResponse | MagnetometerResponse) -> list[SensorCoefficientResponse]:
    """Return every coefficient of a result with its standard uncertainty, those of the alignment last."""
    coefficients = _of_force(answer) if isinstance(answer, AccelerometerResponse) else _of_field(answer)
    return list(coefficients)


def _of_force(answer: AccelerometerResponse) -> Iterator[SensorCoefficientResponse]:
    yield from _named("bias", "g", answer.bias_g)
    yield from _named("scale factor", "1", answer.scale_factor)
    yield from _named("misalignment", "1", answer.misalignment)
    if answer.temperature is not None:
        yield from _over_temperature(answer.temperature)
    if answer.alignment is not None:
        yield from _turned("gyro triad", answer.alignment["axes"])


def _of_field(answer: MagnetometerResponse) -> Iterator[SensorCoefficientResponse]:
    yield from _named("hard iron", "uT", answer.hard_iron_ut)
    yield from _named("soft iron", "1", answer.soft_iron)
    yield _estimated("field", "uT", answer.field_ut)
    if answer.alignment is not None:
        yield from _turned("magnetometer", answer.alignment["axes"])
        yield _of("dip of the field", answer.alignment["dip"])


def _over_temperature(law: AccelerometerTemperature) -> Iterator[SensorCoefficientResponse]:
    terms: Sequence[tuple[str, str, Mapping[str, Sequence[Estimate]]]] = (
        ("bias", "g", law.bias_g), ("scale factor", "1", law.scale_factor)
    )  # fmt: skip
    for name, unit_symbol, by_axis in terms:
        for axis in sorted(by_axis):
            for power, each in enumerate(by_axis[axis], start=1):
                per = f"{unit_symbol}/K" + (f"^{power}" if power > 1 else "")
                yield _estimated(f"{name} {axis}, power {power} of temperature", per, each)


def _named(name: str, unit_symbol: str, values: Mapping[str, Estimate]) -> Iterator[SensorCoefficientResponse]:
    for place in sorted(values, key=lambda name: (len(set(name)), name)):  # xx, yy, zz, xy: also of a stored result
        yield _estimated(f"{name} {place}", unit_symbol, values[place])


def _turned(what: str, axes: Mapping[str, AccelerometerCoefficient]) -> Iterator[SensorCoefficientResponse]:
    for axis in sorted(axes):
        yield _of(f"{what} about {axis}", axes[axis])


def _of(name: str, each: AccelerometerCoefficient) -> SensorCoefficientResponse:
    return _stated(name, each["unit"], each["value"], each["u"], each.get("degrees_of_freedom"))


def _estimated(name: str, unit_symbol: str, each: Estimate) -> SensorCoefficientResponse:
    return _stated(name, unit_symbol, each.value, each.u, each.degrees_of_freedom)


def _stated(
    name: str, unit_symbol: str, value: float, u: float | None, freedom: float | None
) -> SensorCoefficientResponse:
    return SensorCoefficientResponse(
        name=name, unit=unit_symbol, value=value, u=u, degrees_of_freedom=freedom,
        expanded=None if u is None else student_factor(freedom) * u,
    )  # fmt: skip

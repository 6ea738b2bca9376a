"""Accelerometer over temperature: in every rest the specific force has the size of gravity, whatever the temperature.

Bias and scale factors are polynomials of the temperature about a reference; misalignments are constant. At the
reference temperature they are the nine parameters of `accelerometer`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from labctl.errors import NotEnoughData
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.poses.at_rest.accelerometer import (
    LARGEST_U,
    PARAMETERS,
    Accelerometer,
    SizeLaw,
    fit_sizes,
    freedom_of_sizes,
    matrices,
    require_poses,
)
from labctl.fitting.poses.at_rest.adequacy import Adequacy, left_out_adequacy
from labctl.fitting.poses.at_rest.gravity import local_gravity_g
from labctl.fitting.poses.at_rest.rests import Rests
from labctl.fitting.poses.readings import PoseReadings
from labctl.fitting.poses.triad import unit

#: Span of the rests' temperatures from which on a coefficient of temperature is fitted, K.
MIN_SPAN_K = 5.0
#: Temperatures further apart than this are different ones, K.
SAME_TEMPERATURE_K = 2.0
#: Largest powers of temperature: of the bias as both flight controllers have, of the scale factors.
BIAS_ORDER, SCALE_ORDER = 3, 1
#: Rests beyond the parameters that are left to tell how well they fit.
MIN_FREEDOM = 3


@dataclass(frozen=True)
class OverTemperature:
    """Coefficients about a reference temperature; powers from 1 on, by axis."""

    reference: Accelerometer  #: at the reference temperature
    reference_c: float
    range_c: tuple[float, float]  #: of the rests
    temperatures: int  #: different ones
    bias_g: NDArray[np.float64]  #: (n, 3) g/K^k
    scale_factor: NDArray[np.float64]  #: (m, 3) 1/K^k
    covariance: NDArray[
        np.float64
    ]  #: (9 + 3n + 3m,) squared: of the nine, the bias by power and axis, the scale factor
    adequacy: Adequacy
    constant_g: float  #: what nine parameters without temperature leave of the used rests, g

    @property
    def u(self) -> Array:
        """Standard uncertainties in the order of `covariance`."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def u_freedom(self) -> Array:
        """Their degrees of freedom: those of one scatter of the rests."""
        return np.full(len(self.covariance), self.reference.u_freedom[0])

    def at_reference_g(self, accel_g: NDArray[np.float64], warm_c: Array) -> NDArray[np.float64]:
        """Return what readings (n, 3), g, at temperatures (n,), deg C, would be at the reference temperature, g."""
        away = warm_c - self.reference_c
        change = powers_of(away, len(self.scale_factor)) @ self.scale_factor
        whole = np.eye(3) + self.reference.errors + change[:, :, None] * np.eye(3)
        from_bias = accel_g - self.reference.bias_g - powers_of(away, len(self.bias_g)) @ self.bias_g
        forces = np.linalg.solve(whole, from_bias[:, :, None])[:, :, 0]
        return np.asarray(accel_g - powers_of(away, len(self.bias_g)) @ self.bias_g - change * forces)


@dataclass(frozen=True)
class TemperatureLaw:
    """Sizes of the forces behind the means of k rests, by nine parameters and powers of temperature."""

    accel_g: NDArray[np.float64]  #: (k, 3)
    scaled_temperature: Array  #: (k,) temperature from the reference, over half the span
    orders: tuple[int, int]  #: of the bias, of the scale factor

    @property
    def parameters(self) -> int:
        return PARAMETERS + 3 * sum(self.orders)

    def take(self, rows: NDArray[np.bool_]) -> TemperatureLaw:
        return TemperatureLaw(self.accel_g[rows], self.scaled_temperature[rows], self.orders)

    def forces(self, theta: Array) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the forces (k, 3), g, and the inverse matrices (k, 3, 3)."""
        errors, bias = matrices(theta[:PARAMETERS])
        whole = np.eye(3) + errors + np.zeros((len(self.scaled_temperature), 3, 3))
        diagonal = np.arange(3)
        whole[:, diagonal, diagonal] += self._powers(1) @ self._terms(theta, 1)
        inverse = np.asarray(np.linalg.inv(whole), dtype=np.float64)
        away = self.accel_g - bias - self._powers(0) @ self._terms(theta, 0)
        return np.asarray(np.einsum("kij,kj->ki", inverse, away), dtype=np.float64), inverse

    def sizes(self, theta: Array) -> Array:
        return np.asarray(np.linalg.norm(self.forces(theta)[0], axis=1))

    def jacobian(self, theta: Array) -> NDArray[np.float64]:
        """Return the derivative of the sizes by the parameters, (k, parameters)."""
        force, inverse = self.forces(theta)
        pull = -np.einsum("ki,kij->kj", unit(force), inverse)
        nine = SizeLaw.columns(pull, force)
        per_scale = pull * force
        warmer = [pull * power[:, None] for power in self._powers(0).T] + [
            per_scale * power[:, None] for power in self._powers(1).T
        ]
        return np.hstack([nine, *warmer])

    def _powers(self, which: int) -> NDArray[np.float64]:
        return powers_of(self.scaled_temperature, self.orders[which])

    def _terms(self, theta: Array, which: int) -> NDArray[np.float64]:
        begin = PARAMETERS + 3 * sum(self.orders[:which])
        return theta[begin : begin + 3 * self.orders[which]].reshape(-1, 3)


def powers_of(away: Array, order: int) -> NDArray[np.float64]:
    """Return the powers 1 to `order` of differences (k,), (k, order)."""
    return np.asarray(away[:, None] ** np.arange(1, order + 1), dtype=np.float64)


def at_reference(readings: PoseReadings, rests: Rests, over_temperature: OverTemperature) -> tuple[PoseReadings, Rests]:
    """Return readings and rests with the forces of the reference temperature: `found.reference` fits them.

    Raises NotEnoughData without a thermometer.
    """
    temperatures_c = rest_temperatures(readings, rests)
    assert readings.temperature_c is not None  # refused by the line before
    return (
        replace(readings, accel_g=over_temperature.at_reference_g(readings.accel_g, readings.temperature_c)),
        replace(rests, accel_g=over_temperature.at_reference_g(rests.accel_g, temperatures_c)),
    )


def rest_temperatures(readings: PoseReadings, rests: Rests) -> Array:
    """Return the mean temperature of each rest, (k,) deg C. Raises NotEnoughData without a thermometer."""
    temperatures_c = readings.temperature_c
    if temperatures_c is None:
        raise NotEnoughData(
            f"{readings.info.serial}: no temperature was recorded, so its coefficients cannot be fitted; name the "
            "column of the temperature, or calibrate without one"
        )
    sums = np.concatenate([[0.0], np.cumsum(temperatures_c)])
    return np.asarray((sums[rests.end] - sums[rests.begin]) / rests.n)


def calibrate_over_temperature(readings: PoseReadings, rests: Rests) -> OverTemperature:
    """Fit bias and scale factors over temperature to rests at several temperatures.

    The bias has as many powers as temperatures allow, up to 3; the scale factors have one. Raises NotEnoughData where
    poses or temperatures do not determine them, with what to do.
    """
    serial = readings.info.serial
    require_poses(serial, rests)
    temperatures_c = rest_temperatures(readings, rests)
    low, high, levels = float(temperatures_c.min()), float(temperatures_c.max()), different_temperatures(temperatures_c)
    _require_span(serial, low, high, levels)
    orders = (min(BIAS_ORDER, levels - 1), SCALE_ORDER)
    reference, half = round((low + high) / 2, 1), (high - low) / 2
    law = TemperatureLaw(rests.accel_g, (temperatures_c - reference) / half, orders)
    if len(rests) < law.parameters + MIN_FREEDOM:
        raise NotEnoughData(
            f"{serial}: {len(rests)} rests at {levels} temperatures; {law.parameters} coefficients need at least "
            f"{law.parameters + MIN_FREEDOM} rests: lay the unit down on more faces and edges at each temperature"
        )
    gravity = local_gravity_g(readings.info)
    white = rests.accel_white_var.mean(axis=1)
    theta, sigma, used = fit_sizes(law, gravity, white, law.parameters + MIN_FREEDOM)
    kept = law.take(used)
    jacobian = kept.jacobian(theta) / sigma[used][:, None]
    covariance = np.asarray(np.linalg.pinv(jacobian.T @ jacobian, hermitian=True), dtype=np.float64)
    _require_determined(serial, jacobian, covariance, law)
    white = white[used]
    left = kept.sizes(theta) - gravity
    before = np.linalg.norm(kept.accel_g, axis=1) - gravity
    worth = left_out_adequacy(left, jacobian, covariance, sigma[used], white, before)
    errors, bias = matrices(theta[:PARAMETERS])
    freedom = int(np.count_nonzero(used)) - law.parameters
    at_reference = Accelerometer(
        errors, bias, covariance[:PARAMETERS, :PARAMETERS], unit(law.forces(theta)[0]), sigma, used,
        float(np.sqrt(np.mean(left**2))), gravity, freedom,
        np.full(PARAMETERS, freedom_of_sizes(freedom, white, sigma[used])),
    )  # fmt: skip
    powers = np.concatenate([np.repeat(np.arange(1.0, order + 1), 3) for order in orders])
    per_k = np.concatenate([np.ones(PARAMETERS), half**-powers])
    in_kelvin = theta * per_k
    split = PARAMETERS + 3 * orders[0]
    return OverTemperature(
        at_reference, reference, (low, high), levels, in_kelvin[PARAMETERS:split].reshape(-1, 3),
        in_kelvin[split:].reshape(-1, 3), np.asarray(covariance * np.outer(per_k, per_k)), worth,
        _constant_g(SizeLaw(kept.accel_g), gravity, white),
    )  # fmt: skip


def _require_span(serial: str, low: float, high: float, levels: int) -> None:
    """Raise NotEnoughData for rests at temperatures, deg C, that tell no coefficient of temperature."""
    if levels < 2 or high - low < MIN_SPAN_K:
        raise NotEnoughData(
            f"{serial}: the rests are at {low:.1f} to {high:.1f} deg C; coefficients of temperature need poses at two "
            f"and more temperatures that span {MIN_SPAN_K:g} K: lay the unit down in its poses again, warmer or "
            "colder, or calibrate without a temperature"
        )


def different_temperatures(temperatures_c: Array) -> int:
    """Return how many temperatures (k,) are further than SAME_TEMPERATURE_K from the next lower one that counts."""
    count, last = 0, -np.inf
    for each in np.sort(temperatures_c):
        if each - last > SAME_TEMPERATURE_K:
            count, last = count + 1, each
    return count


def _constant_g(law: SizeLaw, gravity: float, white: Array) -> float:
    """Return what nine parameters leave of the rests, g: none is left out for what its temperature does."""
    theta, _, _ = fit_sizes(law, gravity, white, len(white))
    return float(np.sqrt(np.mean((law.sizes(theta) - gravity) ** 2)))


def _require_determined(
    serial: str, jacobian: NDArray[np.float64], covariance: NDArray[np.float64], law: TemperatureLaw
) -> None:
    """Raise NotEnoughData unless each coefficient is known to LARGEST_U over half of the span."""
    rank = np.linalg.matrix_rank(jacobian / np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300), tol=1e-6)
    u = float(np.sqrt(np.diag(covariance)).max())
    if rank < law.parameters or u > LARGEST_U:
        raise NotEnoughData(
            f"{serial}: poses and temperatures do not determine the {law.parameters} coefficients (the least certain "
            f"has u = {u if rank == law.parameters else np.inf:.2g} over half of the span, limit {LARGEST_U:g}): lay "
            "the unit down on each face, and on edges, at each temperature"
        )

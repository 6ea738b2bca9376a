"""What a calibration does to output and temperature alone, and how far another formula is from it."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from labctl.calibration import Calibration
from labctl.errors import BadInput
from labctl.exports.force_text import force_losses
from labctl.exports.format import Loss
from labctl.fitting.models.correction import correction
from labctl.fitting.models.memory import Memory, split_memory
from labctl.fitting.models.temperature import LagrangeTable
from labctl.fitting.numeric.arrays import Array

#: Points of a range at which a difference is looked for.
RATES, TEMPERATURES = 41, 81
#: Outputs of each axis and temperatures at which all axes turn at once.
CORNERS, CORNER_TEMPERATURES = 5, 21
NEWTON_STEPS, SLOPE_STEP_DPS = 4, 1.0
#: The loss of a lag is said for this change of temperature, K/min.
WARMING_K_MIN = 1.0


@dataclass(frozen=True)
class StaticPart:
    """A calibration without lag and hysteresis: corrected rates of outputs (n, axes) at temperatures (n,)."""

    calibration: Calibration
    rate: Callable[[Array, Array], Array]
    memory: Memory | None

    @property
    def axes(self) -> tuple[str, ...]:
        """The axes that are corrected."""
        return self.calibration.axes

    @property
    def has_rates(self) -> bool:
        """Whether a range of rates was calibrated; not where the model is a bias alone."""
        return bool(np.isfinite(self.calibration.rate_dps).all())

    def temperatures(self, n: int = TEMPERATURES) -> Array:
        """Return n temperatures from end to end, (n,) deg C; raises BadInput where none was calibrated."""
        return np.linspace(*self.calibration.temperature_c, n)

    def with_kinks(self, temperature_c: Array) -> Array:
        """Return rising temperatures with those at which a table over temperature bends: a difference peaks there."""
        basis, (low, high) = self.calibration.fitted.model.temperature, self.calibration.temperature_c
        nodes = np.array(basis.nodes_c if isinstance(basis, LagrangeTable) else [])
        return np.union1d(temperature_c, nodes[(nodes > low) & (nodes < high)])

    def outputs(self, n: int = RATES) -> Array:
        """Return n outputs of one axis from end to end of the calibrated rates, (n,) deg/s; one, 0, without rates."""
        return np.linspace(*self.calibration.rate_dps, n) if self.has_rates else np.zeros(1)

    def bias_dps(self, temperature_c: Array) -> Array:
        """Return the output at true rate 0, (n, axes) deg/s, by Newton's method on the correction."""
        n, axes = len(temperature_c), len(self.axes)
        bias = np.zeros((n, axes))
        for _ in range(NEWTON_STEPS):
            residual_rate = self.rate(bias, temperature_c)
            slope = np.empty((n, axes, axes))
            for column in range(axes):
                moved = bias.copy()
                moved[:, column] += SLOPE_STEP_DPS
                slope[:, :, column] = (self.rate(moved, temperature_c) - residual_rate) / SLOPE_STEP_DPS
            bias = bias - np.linalg.solve(slope, residual_rate[:, :, None])[:, :, 0]
        return bias

    def memory_losses(self) -> tuple[Loss, ...]:
        """Return what is lost where a format carries neither lag nor hysteresis."""
        return follower_losses(self.memory, float(np.abs(self.outputs()).max()))

    def losses(self) -> tuple[Loss, ...]:
        """Return what is lost where a format knows output and temperature alone."""
        return (*self.memory_losses(), *force_losses(self.calibration))


def follower_losses(memory: Memory | None, fastest_dps: float) -> tuple[Loss, ...]:
    """Return what is lost where a format does not carry the memory; nothing without one.

    That of a lag of the scale factor is stated at the fastest calibrated rate.
    """
    losses: dict[str, float] = {}
    for each in memory.followers if memory is not None else ():
        of, size = "bias", float(np.abs(each.size).max())
        if each.scale is not None:
            of, size = f"scale factor at {fastest_dps:g} deg/s", float(np.abs(each.scale).max()) * fastest_dps
        if each.kind == "play":
            subject = "hysteresis of the bias"
        elif each.part == "curved":
            about = f"for each K from {each.reference_c:g} deg C"
            subject = f"curved thermal lag of the {of}, at {WARMING_K_MIN:g} K/min, {about}"
            size *= 2 * max(each.parameter, each.cooling_s or 0.0) / 60 * WARMING_K_MIN
        else:
            subject = f"thermal lag of the {of}, at {WARMING_K_MIN:g} K/min"
            size *= max(each.parameter, each.cooling_s or 0.0) / 60 * WARMING_K_MIN
        losses[subject] = losses.get(subject, 0.0) + size
    return tuple(Loss(subject, size) for subject, size in losses.items())


def static_part(calibration: Calibration, format_name: str, *, carries: str) -> StaticPart:
    """Return the part that a format of output and temperature can carry; raises BadInput where there is none.

    `carries` is what the format has, and ends the message.
    """
    static_fit, memory = split_memory(calibration.fitted, calibration.axes)
    if static_fit.model.needs:
        raise BadInput(
            f"format {format_name}: model {static_fit.model.name} needs {', '.join(static_fit.model.needs)} beside "
            "output and "
            f"temperature; {carries}; use the JSON file with labctl's Compensator"
        )
    law = correction(static_fit, calibration.axes)
    return StaticPart(calibration, lambda raw, temperature_c: law(raw, temperature_c, {}), memory)


def needs_thermometer(calibration: Calibration, format_name: str, advice: str) -> None:
    """Raise BadInput for a calibration that was made without a thermometer."""
    if not np.isfinite(calibration.temperature_c).all():
        raise BadInput(f"format {format_name}: {calibration.serial} was calibrated without a thermometer; {advice}")


@dataclass(frozen=True)
class Differences:
    """How far a formula is from a calibration over its whole range, deg/s, (axes,) each."""

    at_rest: Array  #: at true rate 0
    turning: Array  #: while the axis itself turns
    cross: Array  #: by the other axes' rates, all of them together
    corners: Array  #: while all axes turn at once

    @property
    def together(self) -> float:
        """The largest difference of any axis, with all axes turning at any of their rates."""
        return float(np.maximum(np.maximum(self.turning, self.at_rest) + self.cross, self.corners).max())


def differences(part: StaticPart, formula: Callable[[Array, Array], Array]) -> Differences:
    """Compare corrected rates by a formula, (n, axes) of outputs (n, axes) and temperatures (n,), with a calibration's.

    One axis turns at a time, through its calibrated rates; what several do at once is the sum in models whose axes act
    through a matrix, and is evaluated in the corners of the range for the others.
    """
    axes = len(part.axes)
    dense_c = part.with_kinks(part.temperatures(1 + 8 * (TEMPERATURES - 1)))
    still = part.bias_dps(dense_c)
    at_rest = np.abs(formula(still, dense_c) - part.rate(still, dense_c)).max(axis=0)
    coarse_c = part.with_kinks(part.temperatures())
    temperature_c = np.repeat(coarse_c, len(part.outputs()))
    base = np.repeat(part.bias_dps(coarse_c), len(part.outputs()), axis=0)
    apart = np.zeros((axes, axes))
    for turning in range(axes):
        raw = base.copy()
        raw[:, turning] = np.tile(part.outputs(), len(coarse_c))
        apart[:, turning] = np.abs(formula(raw, temperature_c) - part.rate(raw, temperature_c)).max(axis=0)
    while_turning = np.maximum(np.diag(apart), at_rest)
    raw, temperature_c = all_turning(part)
    corners = np.abs(formula(raw, temperature_c) - part.rate(raw, temperature_c)).max(axis=0)
    return Differences(at_rest, while_turning, apart.sum(axis=1) - np.diag(apart), corners)


def all_turning(part: StaticPart) -> tuple[Array, Array]:
    """Return outputs (n, axes) and temperatures (n,) of all axes turning at once: a coarse grid with its corners."""
    corners = np.array(list(itertools.product(part.outputs(CORNERS), repeat=len(part.axes))))
    at = part.temperatures(CORNER_TEMPERATURES)
    return np.repeat(corners, len(at), axis=0), np.tile(at, len(corners))

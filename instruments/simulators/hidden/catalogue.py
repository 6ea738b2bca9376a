"""Effects that can be hidden in a simulated unit, each under its catalogue id: list a new one in `KINDS`."""

from __future__ import annotations

from instruments.simulators.hidden import (
    acceleration,
    alignment,
    bias,
    environment,
    history,
    nonlinearity,
    rate_table,
    scale_factor,
    thermal,
)
from instruments.simulators.hidden.base import HiddenEffect

KINDS: tuple[type[HiddenEffect], ...] = (
    bias.Bias,
    scale_factor.ScaleFactor,
    scale_factor.ScaleFactorAsymmetry,
    scale_factor.ScaleFactorEven,
    scale_factor.ScaleFactorOdd,
    scale_factor.SineResponse,
    scale_factor.Saturation,
    alignment.Misalignment,
    alignment.NonOrthogonality,
    nonlinearity.CrossAxisNonlinearity,
    nonlinearity.DeadBand,
    nonlinearity.Quantization,
    nonlinearity.VibrationRectification,
    history.RateHysteresis,
    history.StartTransient,
    bias.BiasTemperature,
    scale_factor.ScaleFactorTemperature,
    thermal.TemperatureRate,
    thermal.ThermalLag,
    thermal.ThermalHysteresis,
    history.BiasDrift,
    thermal.WarmUp,
    thermal.SelfHeating,
    thermal.ThermometerError,
    history.RunShift,
    history.MountingShift,
    bias.OutsideEtalon,
    acceleration.GSensitivity,
    acceleration.CrossGSensitivity,
    acceleration.GSquaredSensitivity,
    acceleration.CentripetalAcceleration,
    rate_table.EarthRate,
    rate_table.EarthRateTilt,
    rate_table.MagneticSensitivity,
    rate_table.TableTilt,
    rate_table.TableRateRatio,
    rate_table.TableRateRipple,
    rate_table.MissedSteps,
    environment.SupplySensitivity,
    environment.OutsideHumidity,
)

EFFECTS: dict[str, type[HiddenEffect]] = {kind.id: kind for kind in KINDS}


def hidden_effects(sizes: dict[str, float | str], seed: list[int]) -> list[HiddenEffect]:
    """Return effects by id and size; raises ValueError for an unknown id, with the known ones."""
    made = []
    for effect_id, size in sizes.items():
        if effect_id not in EFFECTS:
            raise ValueError(f"effect {effect_id!r} cannot be hidden (there are {', '.join(sorted(EFFECTS))})")
        made.append(EFFECTS[effect_id](float(size), seed))
    return made

"""Effects that can be hidden in a simulated unit, each under its catalogue id.

They are the entry points of the group `labctl.hidden_effects`: a class, or several in a row. labctl's own stand in
`KINDS`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any

from instruments.plugins import PluginGroup
from instruments.simulators.hidden import (
    acceleration,
    alignment,
    bias,
    environment,
    history,
    nonlinearity,
    rate_table,
    response,
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
    response.TimeDelay,
    response.Bandwidth,
    bias.BiasTemperature,
    scale_factor.ScaleFactorTemperature,
    thermal.TemperatureRate,
    thermal.ThermalLag,
    scale_factor.ScaleFactorLag,
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


def _checked(effect: Any) -> tuple[type[HiddenEffect], ...]:
    kinds = (effect,) if isinstance(effect, type) else tuple(effect)
    for kind in kinds:
        if not (isinstance(kind, type) and issubclass(kind, HiddenEffect)):
            raise TypeError(
                f"{kind!r} is not a subclass of instruments.simulators.hidden.HiddenEffect; derive it from that class"
            )
        if missing := [name for name in ("id", "unit", "default") if not hasattr(kind, name)]:
            raise TypeError(f"{kind.__name__} does not define {', '.join(missing)}; add it")
    return kinds


FAMILIES: PluginGroup[tuple[type[HiddenEffect], ...]] = PluginGroup(
    "labctl.hidden_effects", "family of hidden effects", _checked
)


class HiddenCatalogue(Mapping[str, type[HiddenEffect]]):
    """Installed hidden effects by id, labctl's own first; they are imported at first use."""

    def __getitem__(self, effect_id: str) -> type[HiddenEffect]:
        return _by_id()[effect_id]

    def __iter__(self) -> Iterator[str]:
        return iter(_by_id())

    def __len__(self) -> int:
        return len(_by_id())


@cache
def _by_id() -> dict[str, type[HiddenEffect]]:
    return FAMILIES.merged(lambda kinds: ((kind.id, kind) for kind in kinds), "hidden effect")


EFFECTS: Mapping[str, type[HiddenEffect]] = HiddenCatalogue()


def hidden_effects(sizes: dict[str, float | str], seed: list[int]) -> list[HiddenEffect]:
    """Return effects by id and size; raises ValueError for an unknown id, with the known ones."""
    made = []
    for effect_id, size in sizes.items():
        if effect_id not in EFFECTS:
            raise ValueError(f"effect {effect_id!r} cannot be hidden; choose one of {', '.join(sorted(EFFECTS))}")
        made.append(EFFECTS[effect_id](float(size), seed))
    return made

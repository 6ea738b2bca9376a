"""What is known of the noise of a unit before a campaign: its data sheet, earlier calibrations of it or its type."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from instruments.bench_config import BenchFile, GyroSettings
from instruments.datasheet import datasheet_figure
from labctl.errors import BadInput
from labctl.fitting.data.channels import BODY_AXES, Channels
from labctl.fitting.data.noise_floor import BY_DATA_SHEET
from labctl.fitting.design.noise_figures import (
    OTHER_ELEMENT_U_S,
    USUAL_BIAS_PER_K,
    USUAL_ELEMENT_U_S,
    USUAL_SCALE_PER_K,
    USUAL_TAUS_S,
    AxisNoiseFigures,
    NoiseFigures,
    UnsettledHeat,
)
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.drift_noise import USUAL_STABILITY_DPS
from procedures.recipe.schemes import Span

if TYPE_CHECKING:
    from labctl.store import CalibrationRecord, Store

#: White noise where neither a data sheet nor a calibration states it, deg/s/rtHz.
USUAL_WHITE_DPS_RTHZ = 0.01
#: Of a data set of an earlier calibration whose campaign is not in the database, s.
USUAL_DURATION_S = 60.0


@dataclass(frozen=True)
class Known:
    """The noise that a design counts with, and where it is from."""

    noise: NoiseFigures
    sources: tuple[str, ...]  #: sentences


@dataclass(frozen=True)
class _Earlier:
    """An earlier calibration."""

    text: str  #: serial number and version
    white_dps_rthz: float | None
    drift_dps: float
    tau_s: float | None
    bias_per_k: float
    scale_per_k: float


def known_noise(store: Store | None, bench: BenchFile, axes: Sequence[str], prior: Sequence[str], span: Span) -> Known:
    """Return the noise of the unit of a bench with those outputs.

    `prior` are serial numbers: of each the newest calibration counts. Raises NotFound, and BadInput for a unit without
    one.
    """
    gyro = next((each for each in bench.gyros if set(axes) <= set(each.axes)), bench.gyros[0])
    earlier = [_earlier(store, serial, span) for serial in prior] if store is not None else []
    white, white_text = _white(gyro, earlier)
    drift, tau_s, drift_text = _drift(gyro, earlier)
    heat, heat_text = _heat(gyro, earlier)
    figures = AxisNoiseFigures(white, drift, tau_s)
    return Known(NoiseFigures(dict.fromkeys(axes, figures), heat), (white_text, drift_text, heat_text))


def _white(gyro: GyroSettings, earlier: Sequence[_Earlier]) -> tuple[float, str]:
    densities = [each.white_dps_rthz for each in earlier if each.white_dps_rthz is not None]
    if densities:
        value, source = _rms(densities), f"from {_named(earlier)}"
    elif stated := _stated(gyro, "angle_random_walk_dps_rthz"):
        value, source = stated, "from the data sheet in the bench file"
    else:
        value, source = USUAL_WHITE_DPS_RTHZ, "assumed: neither a data sheet nor an earlier calibration states it"
    return value, f"white noise {value:.3g} deg/s/rtHz, {source}"


def _drift(gyro: GyroSettings, earlier: Sequence[_Earlier]) -> tuple[float, float | None, str]:
    if earlier:
        value = _rms([each.drift_dps for each in earlier])
        taus = [each.tau_s for each in earlier if each.tau_s is not None]
        tau_s = float(np.median(taus)) if taus else None
        source = f"from {_named(earlier)}"
    else:
        stated = _stated(gyro, "bias_stability_dps")
        value, tau_s = (stated or USUAL_STABILITY_DPS) / 2, None
        source = "half the bias stability of the data sheet" if stated else "assumed, as no data sheet states it"
    over = f"{tau_s:.0f} s" if tau_s else f"{USUAL_TAUS_S[0]:g} to {USUAL_TAUS_S[-1]:g} s (assumed)"
    return value, tau_s, f"drift {value:.3g} deg/s over {over}, {source}"


def _heat(gyro: GyroSettings, earlier: Sequence[_Earlier]) -> tuple[UnsettledHeat, str]:
    element_u_s = USUAL_ELEMENT_U_S.get(gyro.technology, OTHER_ELEMENT_U_S)
    bias, scale, source = USUAL_BIAS_PER_K, USUAL_SCALE_PER_K, "assumed"
    if earlier:
        bias, scale = _rms([each.bias_per_k for each in earlier]), _rms([each.scale_per_k for each in earlier])
        source = f"from {_named(earlier)}"
    text = (
        f"the sensing element follows the thermometer by an unknown time, standard uncertainty {element_u_s:g} s "
        f"(assumed{f' for {gyro.technology}' if gyro.technology else ''}), with {bias:.2g} deg/s of bias and "
        f"{scale:.2g} of scale factor per K, {source}"
    )
    return UnsettledHeat(element_u_s, bias, scale), text


def _earlier(store: Store, serial: str, span: Span) -> _Earlier:
    unit = store.units.get(serial)
    rows = store.calibrations.of_unit(unit.serial)
    if not rows:
        raise BadInput(
            f"unit {unit.serial!r} has no calibration, so that nothing is known of its noise; "
            f"`labctl fit {unit.serial}` makes one, or leave --prior out"
        )
    row = max(rows, key=lambda each: each.version)
    document = json.loads(row.document)
    noise = list(document["noise"].values())
    white = [each["white_dps"] for each in noise if each["white_dps"] is not None]
    # flicker has no time constant: it counts as one that is not known, as does that of a drift by the data sheet, for
    # which earlier versions of labctl stored 1 s
    is_found = document.get("error", {}).get("noise_floor_source") != BY_DATA_SHEET
    taus = [
        each["drift_tau_s"] for each in noise if is_found and each["drift_tau_s"] and "drift_shortest_tau_s" not in each
    ]
    bias, scale = _slopes(FittedModel.from_dict(document["model"]), span)
    return _Earlier(
        f"{unit.serial} version {row.version}",
        _rms(white) * float(np.sqrt(_duration_s(store, row))) if white else None,
        _rms([each["drift_dps"] for each in noise]), float(np.median(taus)) if taus else None, bias, scale,
    )  # fmt: skip


def _duration_s(store: Store, row: CalibrationRecord) -> float:
    """Return how long a data set lasted, s: as the recipe of its campaign says."""
    for number in (*row.recordings, row.recording):
        recording = None if number is None else store.recordings.get(number)
        if recording is not None and recording.campaign is not None:
            acquire = dict(store.campaigns.get(recording.campaign).recipe).get("acquire")
            if isinstance(acquire, Mapping) and isinstance(duration_s := acquire.get("duration_s"), int | float):
                return float(duration_s)
    return USUAL_DURATION_S


def _slopes(fitted: FittedModel, span: Span) -> tuple[float, float]:
    """Return the change of bias, deg/s per K, and of scale factor, 1/K: root mean square over outputs and range."""
    temperatures_c = np.linspace(span.low_c, span.high_c, 10)
    bias: list[float] = []
    scale: list[float] = []
    for axis in fitted.axes:
        still, turning = (_error(fitted, axis, temperatures_c, rate) for rate in (0.0, span.rate_dps))
        bias += (np.gradient(still, temperatures_c)).tolist()
        scale += (np.gradient(turning - still, temperatures_c) / max(span.rate_dps, 1e-9)).tolist()
    return _rms(bias), _rms(scale)


def _error(fitted: FittedModel, axis: str, temperatures_c: Array, rate_dps: float) -> Array:
    rates = {each: np.full(len(temperatures_c), rate_dps if each == axis else 0.0) for each in BODY_AXES}
    columns = {
        "temperature_c": temperatures_c,
        "table_rate_dps": rates[axis],
        "position": np.full(len(temperatures_c), axis),
    }
    return np.asarray(fitted.error_dps(Channels(columns, rates), axis))


def _stated(gyro: GyroSettings, name: str) -> float | None:
    figure = datasheet_figure(name, gyro.datasheet, gyro.datasheet_conventions, gyro.model)
    return None if figure is None else figure.u


def _rms(values: Sequence[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _named(earlier: Sequence[_Earlier]) -> str:
    return ", ".join(_texts(earlier))


def _texts(earlier: Sequence[_Earlier]) -> Iterator[str]:
    for each in earlier:
        yield each.text

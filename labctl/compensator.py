"""The run-time side: a calibration file in, corrected rates out, in arrays or sample by sample. No database."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from instruments.clock import Clock, SystemClock
from labctl.calibration import Calibration, read_calibration
from labctl.calibration.certification import LeftOutWarning, warn
from labctl.calibration.document import read_source
from labctl.errors import BadInput
from labctl.fitting.data.channels import BODY_AXES
from labctl.fitting.data.temperature.channel import STAND_IN_C
from labctl.fitting.data.temperature.history import TemperatureHistory
from labctl.fitting.models.correction import Correct, correct_across, correction, with_scale
from labctl.fitting.models.memory import BLOCK, MemoryState, Remembered, RunningMemory, check_order, split_memory

if TYPE_CHECKING:
    from pathlib import Path

__all__ = [
    "MARGIN_C",
    "MARGIN_SHARE",
    "Compensated",
    "Compensator",
    "LeftOutWarning",
    "MemoryState",
    "Outside",
    "output_limits_dps",
]

Array = NDArray[np.float64]
Outside = Literal["clamp", "refuse"]
#: Beyond the calibrated temperatures by no more than this counts as inside, K: a thermometer's last digits.
MARGIN_C = 0.5
#: The range of rates is taken wider by this share: it was measured in true rates and is compared with output rates.
MARGIN_SHARE = 0.02


@dataclass(frozen=True)
class Compensated:
    """Corrected rates of the shape that was given, and which samples lay outside what was calibrated, (n,)."""

    rate_dps: Array
    outside: NDArray[np.bool_]
    #: The largest error by 1 g of each axis, (axes,) deg/s, that was not corrected because no specific force was given;
    #: None: nothing was left out that the calibration knows of.
    left_out_dps: Array | None = None


def output_limits_dps(calibration: Calibration) -> tuple[float, float]:
    """Return the lowest and highest output, deg/s, that counts as inside; infinite where there is no limit of rate."""
    slow, fast = calibration.rate_dps
    margin = MARGIN_SHARE * max(fast - slow, 1e-9)
    return slow - margin, fast + margin


class Compensator:
    """Corrects a unit's output by its calibration.

    Outside the calibrated temperatures and rates it either takes off the error at the edge of the range and flags the
    sample ("clamp"), or raises BadInput ("refuse"). A sample that is not a number, or whose temperature is none, comes
    back as no number, flagged. Temperatures count as inside up to `MARGIN_C` beyond the calibrated ones, but are
    corrected at the edge; rates up to `MARGIN_SHARE` of their range. The C header does the same.

    A lag or a hysteresis (`remembers`) is followed from sample to sample: `step` goes on from the last one, an array is
    a course of its own unless it is `continued`. Both then need the times, `t_s`. The unit is taken to have rested at
    its first temperature, unless `start` is given the `state` of an earlier use.

    g-sensitivity (`force_sensitivity`) is corrected where `specific_force_g` is given: (3,) or (n, 3) g along the body
    axes x, y, z, +1 along an axis that points up at rest. Without it the answer says what was left out; `step`, which
    answers with numbers alone, issues a LeftOutWarning once. It is measured at 1 g, taken as proportional beyond, and
    no range of forces is flagged. A calibration without g-sensitivity ignores the force.
    """

    def __init__(self, calibration: Calibration, outside: Outside = "clamp", *, clock: Clock | None = None) -> None:
        """Issue a CalibrationWarning where the file says that it is overdue by `clock` (the computer's), or revoked.

        Raises BadInput for another word in `outside`.
        """
        if outside not in {"clamp", "refuse"}:
            raise BadInput(f"outside = {outside!r} is not known; give 'clamp' or 'refuse'")
        self.calibration = calibration
        #: That the calibration was overdue or revoked when it was loaded; empty where it was neither.
        self.warning = calibration.warning((clock or SystemClock()).utc())
        warn(self.warning)
        self.axes = calibration.axes
        self._outside = outside
        self._low_c, self._high_c = calibration.temperature_c
        self._slow, self._fast = output_limits_dps(calibration)
        lines = calibration.output
        self._offset = np.array([lines[axis].offset for axis in self.axes])
        self._scale = np.array([lines[axis].scale for axis in self.axes])
        rest, self._memory = split_memory(calibration.fitted, self.axes)
        self._model = rest
        self._correct = correction(rest, self.axes)
        self._running = RunningMemory(self._memory) if self._memory else None
        #: What specific force adds; None: the calibration knows of nothing.
        self.force_sensitivity = calibration.force_sensitivity
        self._left_out_dps = self.force_sensitivity.at_1_g_dps if self.force_sensitivity else None
        self._has_warned = False
        self._is_direct = calibration.fitted.model.argument == "output"
        #: Channels beside output and temperature that the model's effects need, such as power_s, supply_v or t_s.
        self.needs = tuple(dict.fromkeys((*rest.model.needs, *(("t_s",) if self._memory else ()))))

    @classmethod
    def from_file(cls, path: Path | str, outside: Outside = "clamp") -> Compensator:
        """Load a calibration file; raises BadCalibrationFile when it was edited or is not whole.

        One that is overdue or was revoked issues a CalibrationWarning and is loaded.
        """
        return cls(read_source(path), outside)

    @classmethod
    def from_bytes(cls, content: bytes, outside: Outside = "clamp") -> Compensator:
        """Load a calibration from the bytes that the service gives; raises BadCalibrationFile."""
        return cls(read_calibration(content), outside)

    @property
    def remembers(self) -> bool:
        """Whether the correction of a sample depends on the temperatures before it."""
        return self._memory is not None

    def reset(self) -> None:
        """Clear the temperature history, as after the unit was switched off."""
        if self._running is not None:
            self._running.reset()

    @property
    def state(self) -> MemoryState | None:
        """What `step` and continued arrays go on from; None before the first sample, and where nothing `remembers`."""
        return self._running.state if self._running is not None else None

    def start(self, state: MemoryState) -> None:
        """Go on from the `state` of an earlier use (a warm start).

        Raises BadInput where nothing `remembers`, and for the state of another calibration.
        """
        if self._running is None:
            raise BadInput(
                f"{self.calibration.serial}: its calibration has no lag and no hysteresis, so it has no state to start "
                "from; leave start() out"
            )
        self._running.start(state)

    def compensate_output(
        self,
        output: Array,
        temperature_c: Array | None,
        channels: Mapping[str, Array] | None = None,
        *,
        specific_force_g: ArrayLike | None = None,
    ) -> Compensated:
        """Correct what the device gives in its own unit, (n, axes) or (n,); see `compensate`."""
        values = np.asarray(output, dtype=np.float64)
        offset, scale = (self._offset, self._scale) if values.ndim == 2 else (self._offset[0], self._scale[0])
        rates = (values - offset) / scale
        return self.compensate(rates, temperature_c, channels, specific_force_g=specific_force_g)

    def compensate(
        self,
        raw_dps: Array,
        temperature_c: Array | float | None,
        channels: Mapping[str, Array] | None = None,
        *,
        history: TemperatureHistory | None = None,
        specific_force_g: ArrayLike | None = None,
        cross_rates_dps: Mapping[str, ArrayLike] | None = None,
        continued: bool = False,
    ) -> Compensated:
        """Correct rates, (n, axes) deg/s, or (n,) for one axis, at temperatures (n,), (n, axes) or one for all.

        None for the temperature where the calibration was made without a thermometer. `channels` hold what the model
        `needs` besides, (n,) each, or one for all that is no time; `history`, of a recording, what the temperatures
        were between the samples too; `specific_force_g` is (3,) or (n, 3). `cross_rates_dps` are the rates about body
        axes for which the unit has no output, axis -> (n,) or one for all, deg/s, where another instrument measures
        them; without them the unit is corrected as if it did not turn about these axes. With `continued` a lag goes on
        from the sample before, of `step` or of another continued array, and the next one goes on from here. Raises
        BadInput where a channel is missing, for a shape that does not fit, for times that go back, or outside the
        calibrated range when that is refused.
        """
        known = channels or {}
        for name in self.needs:
            if name not in known:
                raise BadInput(f"{self.calibration.serial}: its model needs channel {name!r}; give it with `channels`")
        raw_rows = np.asarray(raw_dps, dtype=np.float64)
        raw = raw_rows.reshape(len(raw_rows), -1) if raw_rows.size and raw_rows.ndim else raw_rows.reshape(-1, 1)
        if raw.size == 0:
            return Compensated(raw_rows, np.zeros(len(raw), dtype=bool))
        if raw.shape[1] != len(self.axes):
            raise BadInput(
                f"rates of {raw.shape[1]} axes given; the calibration has axes {', '.join(self.axes)}; give one rate "
                "for each"
            )
        checked_c = self._fitting(self._known(temperature_c), known, len(raw))
        beside = self._by_force(specific_force_g, len(raw))
        correct = self._correct if cross_rates_dps is None else self._correct_across(cross_rates_dps, len(raw))
        if self._memory is None or history is not None:
            if self._memory is not None and history is not None:
                remembered = self._memory.of_history(history, {"temperature_c": _one_c(checked_c, len(raw)), **known})
                beside = remembered if beside is None else remembered.with_bias(beside.bias_dps)
            compensated = self._beside(beside, raw, checked_c, known, correct)
        else:
            running = self._running if continued and self._running is not None else RunningMemory(self._memory)
            compensated = self._followed(
                running, beside, raw, checked_c, known, correct, len(raw) if cross_rates_dps else BLOCK
            )
        left_out = self._left_out_dps if specific_force_g is None else None
        return Compensated(compensated.rate_dps.reshape(raw_rows.shape), compensated.outside, left_out)

    def _followed(
        self, running: RunningMemory, by_force: Remembered | None, raw: Array, temperature_c: Array,
        of_channels: Mapping[str, Array], correct: Correct, at_once: int,
    ) -> Compensated:  # fmt: skip
        """Correct a course of outputs (n, axes), so many samples `at_once`, that they stay in the processor's cache."""
        n = len(raw)
        channels = {name: np.asarray(values) for name, values in of_channels.items()}
        t_s = channels["t_s"].astype(np.float64, copy=False)
        check_order(running, t_s)
        rate, outside = np.empty_like(raw), np.empty(n, dtype=bool)
        for first in range(0, n, at_once):
            rows = slice(first, first + at_once)
            of_rows = {name: values[rows] if values.shape == (n,) else values for name, values in channels.items()}
            warm_rows = temperature_c[rows] if temperature_c.ndim else temperature_c
            beside = running.errors(t_s[rows], _one_c(warm_rows, len(t_s[rows])))
            if by_force is not None:
                beside = beside.with_bias(by_force.bias_dps[rows])
            block = self._beside(beside, raw[rows], warm_rows, of_rows, correct, first)
            rate[rows], outside[rows] = block.rate_dps, block.outside
        return Compensated(rate, outside)

    def _beside(
        self, beside: Remembered | None, raw: Array, temperature_c: Array, channels: Mapping[str, Array],
        correct: Correct,
        first: int = 0,
    ) -> Compensated:  # fmt: skip
        """Correct outputs (n, axes) of which errors of bias and scale factor, (n, axes), are known; None: none.

        `first` is the number of samples before them.
        """
        if beside is None:
            return self._held(raw, temperature_c, channels, correct, first)
        if self._is_direct:
            compensated = self._held(
                np.where(np.isnan(beside.bias_dps), np.nan, raw), temperature_c, channels, correct, first
            )
            rate = compensated.rate_dps - beside.bias_dps
            if beside.scale is not None:
                rate = rate - beside.scale * np.clip(raw, self._slow, self._fast)
            return Compensated(rate, compensated.outside)
        less = raw - beside.bias_dps
        compensated = self._held(less, temperature_c, channels, correct, first)
        rate = compensated.rate_dps
        if beside.scale is not None:
            held = partial(self._at_edge, temperature_c=temperature_c, channels=channels, correct=correct)
            rate = with_scale(held, less, beside.scale, self._slow, self._fast)
        return Compensated(rate, compensated.outside)

    def _by_force(self, specific_force_g: ArrayLike | None, n: int) -> Remembered | None:
        """Return what specific force adds to the bias; it remembers nothing."""
        if specific_force_g is None or self.force_sensitivity is None:
            return None
        return Remembered(self.force_sensitivity.error_dps(self.force_sensitivity.forces(specific_force_g, n)))

    def _correct_across(self, cross_rates_dps: Mapping[str, ArrayLike], n: int) -> Correct:
        """Return the correction at known rates about axes without an output; raises BadInput for any other axis."""
        beside = [axis for axis in BODY_AXES if axis not in self.axes]
        for axis, rates in cross_rates_dps.items():
            if axis not in beside:
                raise BadInput(
                    f"cross_rates_dps of axis {axis!r}: {self.calibration.serial} has outputs {', '.join(self.axes)}; "
                    f"give rates about {' and '.join(beside) or 'no axis'} only"
                )
            if np.shape(rates) not in {(), (n,)}:
                raise BadInput(
                    f"cross_rates_dps of axis {axis!r} has shape {np.shape(rates)}; give one rate, or one for each of "
                    f"the {n} samples"
                )
        across = {axis: np.broadcast_to(np.asarray(r, np.float64), (n,)) for axis, r in cross_rates_dps.items()}
        return partial(correct_across, self._model, self.axes, across)

    def _held(
        self, raw: Array, temperature_c: Array, channels: Mapping[str, Array], correct: Correct, first: int
    ) -> Compensated:
        """Correct outputs (n, axes) by what does not remember, at the edge of the range where they are outside."""
        # what is no number is neither above nor below, so that a sample with it is judged
        is_warm = np.min(temperature_c) >= self._low_c and np.max(temperature_c) <= self._high_c
        if is_warm and np.min(raw) >= self._slow and np.max(raw) <= self._fast:
            return Compensated(correct(raw, temperature_c, channels), np.zeros(len(raw), dtype=bool))
        flags = self._judge(raw, temperature_c, first)
        return Compensated(self._at_edge(raw, temperature_c, channels, correct), flags)

    def _at_edge(self, raw: Array, temperature_c: Array, channels: Mapping[str, Array], correct: Correct) -> Array:
        """Return corrected rates, (n, axes); of what is outside the range the error at its edge is taken off."""
        held = np.clip(raw, self._slow, self._fast)
        return correct(held, np.clip(temperature_c, self._low_c, self._high_c), channels) + (raw - held)

    @property
    def needs_temperature(self) -> bool:
        """Whether each sample needs a temperature; not where the calibration was made without a thermometer."""
        return bool(np.isfinite(self._high_c - self._low_c))

    def _known(self, temperature_c: Array | float | None) -> Array | float:
        if temperature_c is not None:
            return temperature_c
        if self.needs_temperature:
            raise BadInput(
                f"{self.calibration.serial}: its calibration depends on the temperature ({self._low_c:g} to "
                f"{self._high_c:g} deg C); give temperature_c for each sample"
            )
        return STAND_IN_C

    def _fitting(self, temperature_c: Array | float, channels: Mapping[str, Array], n: int) -> Array:
        """Return the temperatures of n samples; raises BadInput where their shape, or that of a channel, is another."""
        temperatures_c, axes = np.asarray(temperature_c, dtype=np.float64), len(self.axes)
        if temperatures_c.shape not in {(), (1,), (n,), (n, axes)}:
            raise BadInput(
                f"temperature_c has shape {temperatures_c.shape}; give one temperature, one for each of the {n} "
                f"samples, or one for each sample and axis, ({n}, {axes}), deg C"
            )
        for name in self.needs:
            one_for_all = {(), (1,)} if name != "t_s" else set()
            if np.shape(channels[name]) not in {(n,), *one_for_all}:
                raise BadInput(
                    f"channel {name!r} has shape {np.shape(channels[name])}; give one value for each of the {n} samples"
                )
        return temperatures_c.reshape(()) if temperatures_c.shape == (1,) else temperatures_c

    def _judge(self, raw: Array, temperature_c: Array, first: int) -> NDArray[np.bool_]:
        """Return which samples are outside the range or no numbers, (n,); raises BadInput when that is refused."""
        spread = (
            temperature_c.reshape(len(raw), -1) if temperature_c.ndim else np.full((len(raw), 1), float(temperature_c))
        )
        within_c = (spread >= self._low_c - MARGIN_C) & (spread <= self._high_c + MARGIN_C)
        cold: NDArray[np.bool_] = ~np.all(within_c, axis=1)
        fast: NDArray[np.bool_] = ~np.all((raw >= self._slow) & (raw <= self._fast), axis=1)
        if self._outside == "refuse" and (cold.any() or fast.any()):
            row = int(np.argmax(cold | fast))
            sentence = (
                f"temperature {spread[row].tolist()} deg C outside {self._low_c:g} to {self._high_c:g} deg C"
                if cold[row]
                else f"rate {raw[row].tolist()} deg/s outside {self._slow:g} to {self._fast:g} deg/s"
            )
            raise BadInput(
                f"sample {first + row + 1}: {sentence} (the range calibrated for {self.calibration.serial} version "
                f"{self.calibration.version}); set outside = 'clamp' to correct such a sample as at the "
                "edge of the range and flag it"
            )
        return np.asarray(cold | fast)

    def step(
        self,
        raw_dps: ArrayLike,
        temperature_c: float | None,
        t_s: float | None = None,
        *,
        specific_force_g: ArrayLike | None = None,
    ) -> tuple[Array, bool]:
        """Correct one sample, (axes,) deg/s, at a specific force (3,) g; returns the rates and whether it lay outside.

        Where the unit `remembers` samples come in order of time, with their times `t_s` in s; raises BadInput for one
        without, or one from before the last.
        """
        raw = np.asarray(raw_dps, dtype=np.float64).reshape(1, -1)
        if specific_force_g is None and self.force_sensitivity is not None and not self._has_warned:
            self._has_warned = True
            warn(f"{self.calibration.serial}: {self.force_sensitivity.sentence()}", LeftOutWarning)
        if self._running is None:
            compensated = self.compensate(raw, temperature_c, specific_force_g=specific_force_g)
            return compensated.rate_dps[0], bool(compensated.outside[0])
        if t_s is None or temperature_c is None:
            raise BadInput(
                f"{self.calibration.serial}: its model depends on earlier temperatures; give t_s and temperature_c"
            )
        if self._running.last_s is not None and t_s < self._running.last_s:
            raise BadInput(
                f"t_s = {t_s:.9g} s is before the last sample's {self._running.last_s:.9g} s; give samples in order of "
                "time, or call reset()"
            )
        by_force = self._by_force(specific_force_g, 1)
        beside = self._running.errors(np.array([t_s]), np.array([temperature_c]))
        compensated = self._beside(
            beside if by_force is None else beside.with_bias(by_force.bias_dps), raw, np.array([temperature_c]),
            {"t_s": np.array([t_s])}, self._correct,
        )  # fmt: skip
        return compensated.rate_dps[0], bool(compensated.outside[0])


def _one_c(temperature_c: Array, n: int) -> Array:
    """Return the temperature of each of n samples, (n,) deg C: the mean where each axis has one."""
    return temperature_c.mean(axis=1) if temperature_c.ndim == 2 else np.broadcast_to(temperature_c, (n,))

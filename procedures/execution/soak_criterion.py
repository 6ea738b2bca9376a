"""Judging a soak: time counts only inside the band, and the unit itself must have come to rest in temperature."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping

import numpy as np

from procedures.contracts.steps import Soak


class SoakCriterion:
    """Decides from the polls of the bench when the units have taken the temperature, and says why not yet.

    The chamber's air is compared with the band; leaving it starts the count again. What ends a soak is the unit: the
    change of its own thermometer over the last `drift_window_s`, as the slope of a straight line through that window
    times its length. A line instead of two readings, so that the thermometer's noise does not keep a soak open.
    A unit without a thermometer cannot be judged; for it the time inside the band has to do.
    """

    def __init__(self, step: Soak) -> None:
        self.step = step
        self.held_s = 0.0
        self.restarts = 0  #: how often the air left the band after it had been inside
        self._last: tuple[float, bool] | None = None  #: time of the last poll, and whether it was inside
        self._gyro_c: dict[str, deque[tuple[float, float]]] = {}

    def add(self, t_s: float, chamber_c: float, gyro_c: Mapping[str, float]) -> None:
        """Take in one poll of the bench: time in s, air and unit temperatures in deg C."""
        inside = abs(chamber_c - self.step.temperature_c) <= self.step.band_c
        if self._last is not None:
            last_s, was_inside = self._last
            if inside and was_inside:
                self.held_s += t_s - last_s
            elif was_inside:
                self.held_s = 0.0
                self.restarts += 1
        self._last = (t_s, inside)
        for name, temperature_c in gyro_c.items():
            window = self._gyro_c.setdefault(name, deque())
            window.append((t_s, temperature_c))
            while len(window) > 2 and window[1][0] <= t_s - self.step.drift_window_s:
                window.popleft()

    def drift_c(self) -> dict[str, float | None]:
        """Return each unit's change over the window, deg C; None while the window is not full yet."""
        return {name: self._line_change_c(window) for name, window in self._gyro_c.items()}

    def _line_change_c(self, window: deque[tuple[float, float]]) -> float | None:
        t_s, temperature_c = np.array(window).T
        if t_s[-1] - t_s[0] < self.step.drift_window_s or len(t_s) < 2:
            return None
        centred_s = t_s - t_s.mean()
        slope_c_per_s = float(centred_s @ temperature_c / (centred_s @ centred_s))
        return slope_c_per_s * self.step.drift_window_s

    def settled(self) -> bool:
        """Return whether the soak is over."""
        if self.held_s < self.step.hold_s:
            return False
        drifts_c = self.drift_c().values()
        return all(drift_c is not None and abs(drift_c) <= self.step.max_drift_c for drift_c in drifts_c)

    def why_not(self) -> str:
        """Return in words what is still missing."""
        step = self.step
        reasons = []
        if self.held_s < step.hold_s:
            reasons.append(
                f"the air was within {step.band_c:g} deg C of {step.temperature_c:g} deg C for {self.held_s:.0f} s"
                f" of {step.hold_s:g} s" + (f", leaving the band {self.restarts} times" if self.restarts else "")
            )
        for name, drift_c in self.drift_c().items():
            if drift_c is None:
                reasons.append(f"{name} has not been monitored for {step.drift_window_s:g} s yet")
            elif abs(drift_c) > step.max_drift_c:
                reasons.append(
                    f"{name} still changes by {drift_c:+.2f} deg C in {step.drift_window_s:g} s,"
                    f" more than {step.max_drift_c:g} deg C"
                )
        return "; ".join(reasons)

    def figures(self) -> dict[str, float]:
        """Return the result as numbers: time held, band, restarts, drift per unit."""
        drifts_c = {f"drift_c.{name}": drift_c for name, drift_c in self.drift_c().items() if drift_c is not None}
        return {
            "held_s": self.held_s,
            "band_c": self.step.band_c,
            "drift_window_s": self.step.drift_window_s,
            "restarts": float(self.restarts),
            **drifts_c,
        }

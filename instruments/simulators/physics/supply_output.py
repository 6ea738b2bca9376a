"""The output of a power supply over time: what was set, and how the output follows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Time constant of the output, s, with the capacitors of the units.
TAU_S = 0.03
#: A regulated output wanders by this share of what an unregulated one does.
REGULATED = 0.01


class SupplyOutput:
    """Voltage of the output at any time; set at times that only rise."""

    def __init__(self, nominal_v: float) -> None:
        self.nominal_v = nominal_v
        self._at_s, self._volts = [-np.inf], [nominal_v]

    def set(self, t_s: float, voltage_v: float) -> None:
        """Set the voltage from a time on, 0 for an output that is off."""
        self._at_s.append(max(t_s, self._at_s[-1]))
        self._volts.append(voltage_v)

    def volts(self, t_s: Array) -> Array:
        """Return the voltage at times (n,) s, (n,) V, without what the output wanders by."""
        at_s, volts = np.asarray(self._at_s), np.asarray(self._volts)
        index = np.maximum(np.searchsorted(at_s, np.asarray(t_s), side="right") - 1, 0)
        before = volts[np.maximum(index - 1, 0)]
        since_s = np.where(index > 0, np.asarray(t_s) - at_s[index], np.inf)
        return np.asarray(volts[index] + (before - volts[index]) * np.exp(-since_s / TAU_S))

"""The rate of a data set by the table's encoder: its angles during the gate, and the straight line through them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from instruments.clock import Clock
from instruments.errors import NoReply
from instruments.interfaces.table import AngleReading, EncoderTable, RateTable, Spin
from procedures.contracts.errors import StepFailed
from procedures.contracts.journal import Event, TableAngles
from procedures.monitoring.campaign_time import CampaignTime

#: From reading to reading, s. Half a turn at the highest rate is no limit: the driver unwraps by the demanded rate.
READ_EVERY_S = 1.0
#: A line through fewer angles is no measurement.
LEAST = 3
#: Replies in a row that may be lost.
MAX_LOST = 2
#: Standard uncertainties by which two rates may differ.
COVERAGE = 3.0


class EncoderLog:
    """Angles of one data set; empty, and without a question, for a table that does not read its angle."""

    def __init__(self, table: RateTable, clock: Clock) -> None:
        self._table, self._clock = table, clock
        self._encoder = table if isinstance(table, EncoderTable) else None
        self._next_s, self._lost = -math.inf, 0
        self.readings: list[AngleReading] = []

    def read(self, *, now: bool = False) -> None:
        """Read the angle if it is due, or now. Raises NoReply after several lost replies, LinkError."""
        if self._encoder is None or (not now and self._clock.now_s() < self._next_s):
            return
        self._next_s = self._clock.now_s() + READ_EVERY_S
        try:
            self.readings.append(self._encoder.read_angle())
            self._lost = 0
        except NoReply:
            self._lost += 1
            if self._lost > MAX_LOST:
                raise

    def result(self, spin: Spin, gate_from_s: float, time: CampaignTime) -> TableAngles | None:
        """Return the angles in campaign time and the rate through them; None for a table without an encoder.

        Raises StepFailed for too few angles.
        """
        if self._encoder is None:
            return None
        if len(self.readings) < LEAST:
            raise StepFailed(
                f"{self._table.name}: its encoder was read {len(self.readings)} times during a data set, but a "
                f"mean rate needs {LEAST} angles; take longer data sets, or check the link"
            )
        t_s = np.array([reading.t_s for reading in self.readings])
        angle_deg = np.array([reading.angle_deg for reading in self.readings])
        u_deg = np.array([math.hypot(reading.u_deg, spin.rate_dps * reading.u_s) for reading in self.readings])
        rate_dps, u_dps, from_deg = fitted_line(t_s - gate_from_s, angle_deg, u_deg)
        if spin.rate_dps == 0 and abs(rate_dps) <= COVERAGE * u_dps:
            rate_dps = 0.0  # it holds its angle
        return TableAngles(
            tuple(np.asarray(time.of(t_s)).tolist()),
            tuple(angle_deg.tolist()),
            rate_dps,
            u_dps,
            from_deg,
            spin.rate_dps,
            is_reference=self._table.limits.reference == "measured",
        )


def fitted_line(
    t_s: NDArray[np.float64], angle_deg: NDArray[np.float64], u_deg: NDArray[np.float64]
) -> tuple[float, float, float]:
    """Return slope, deg/s, its standard uncertainty and the angle at 0 s of a weighted line through (n,) angles.

    Angles that scatter more than their uncertainties say make the slope as much less certain.
    """
    weight = 1 / u_deg**2
    middle_s = float(np.average(t_s, weights=weight))
    middle_deg = float(np.average(angle_deg, weights=weight))
    spread = float(np.sum(weight * (t_s - middle_s) ** 2))
    slope = float(np.sum(weight * (t_s - middle_s) * (angle_deg - middle_deg))) / spread
    left = angle_deg - middle_deg - slope * (t_s - middle_s)
    excess = math.sqrt(max(float(np.sum(weight * left**2)) / max(len(t_s) - 2, 1), 1.0))
    return slope, excess / math.sqrt(spread), middle_deg - slope * middle_s


def rate_event(table: RateTable, angles: TableAngles) -> Event | None:
    """Return a warning where the table does not turn as commanded; None where that is within the uncertainties."""
    if not isinstance(table, EncoderTable) or angles.computed_dps == 0:
        return None
    off_ppm = 1e6 * (angles.rate_dps / angles.computed_dps - 1)
    u_ppm = 1e6 * angles.rate_u_dps / abs(angles.computed_dps)
    limit_ppm = COVERAGE * math.hypot(u_ppm, table.rate_u_ppm)
    if abs(off_ppm) <= limit_ppm:
        return None
    used = (
        "the encoder is the reference, so this difference does not affect a calibration"
        if angles.is_reference
        else (
            "the demanded rate is the reference, so this difference becomes part of the scale factor: set "
            'reference = "measured" in the bench file'
        )
    )
    text = (
        f"{table.name}: table_rate_ratio {off_ppm:+.0f} ppm (u {u_ppm:.0f} ppm, limit {limit_ppm:.0f} ppm): its "
        f"encoder measures {angles.rate_dps:.5f} deg/s, but {angles.computed_dps:g} deg/s was demanded; {used}"
    )
    return Event(
        "table_rate_ratio", text, level="warning", device=table.name, value=off_ppm, limit=limit_ppm, unit="ppm"
    )

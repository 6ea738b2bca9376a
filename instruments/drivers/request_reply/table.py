"""Rate table whose requests and replies a TOML document describes.

The description says how the table is stopped and how it is confirmed that it stands; one that does not is refused
before a byte is sent. A motion that fails half-way is stopped. No command of a motion is sent twice.
"""

from __future__ import annotations

import math

from instruments.clock import Clock, sleep_until
from instruments.drivers.driver import TableDriver, Trial
from instruments.drivers.request_reply.dialogue import Dialogue
from instruments.errors import InstrumentError, LimitError, NoReply, RequestRejected
from instruments.interfaces.table import AngleReading, Spin, TableLimits, reply_time_u_s
from instruments.protocols.request_reply.settings import DescribedTableSettings, parameters_of
from instruments.protocols.request_reply.table import SIGN
from instruments.protocols.request_reply.templates import as_written
from instruments.transport.factory import Ports
from instruments.transport.line_link import LineLink
from instruments.transport.serial_stream import line_of

#: A motion may last this much longer than computed, s and share.
END_TOLERANCE_S, END_TOLERANCE_SHARE = 10.0, 0.5
#: In a run the table stays at its rate for at least this much longer than requested, s.
SPARE_S = 0.5
#: A rate is measured by two positions at most so far apart, s and degrees: half a turn is as good as its opposite.
MEASURED_OVER_S, MEASURED_OVER_DEG = 1.0, 90.0
#: Two positions tell a rate at least this well, as a share.
COARSE_WITHIN = 0.2


class DescribedTable:
    """A table by its description."""

    def __init__(self, settings: DescribedTableSettings, ports: Ports, clock: Clock) -> None:
        self.name = "table"
        self.settings = settings
        self._described = described = settings.format
        self.limits = TableLimits(settings.max_rate_dps, settings.acceleration_dps2, 0.0, reference=settings.reference)
        self.rate_u_ppm = described.rate_u_ppm
        self._clock = clock
        link = LineLink(
            self.name, settings.address_url, ports, clock, described.line.syntax, baudrate=settings.baudrate,
            timeout_s=described.line.timeout_s, line=line_of(settings.options),
        )  # fmt: skip
        self.dialogue = Dialogue(link, described.line, parameters_of(described, settings.parameters))
        self._rate_dps = 0.0  #: of the run that is under way
        self._last: AngleReading | None = None
        self._quickest_s = math.inf  #: shortest time from a question to its answer

    def identify(self) -> str:
        """Get what the controller says it is; raises WrongInstrument, RequestRejected, MalformedReply, LinkError."""
        return self.dialogue.identity(self._described.identity, self.settings.serial)

    def achievable_dps(self, rate_dps: float) -> float:
        """Get the rate that the command carries for `rate_dps`, deg/s, rounded as it is written; raises LimitError."""
        self.limits.require_rate(self.name, rate_dps)
        scale, motion = self._described.turning, self._described.motion
        number = scale.written(abs(rate_dps))
        written = as_written(motion, "rate", as_written(motion, "speed", number))
        if rate_dps != 0 and written == 0:
            raise LimitError(
                self.name,
                f"rate {rate_dps:g} deg/s is 0 as {self._described.motion_key} of its description writes it; ask "
                "for a higher rate, or give more decimals in the description",
            )
        return math.copysign(scale.read(written), rate_dps) if rate_dps else 0.0

    def home(self) -> None:
        """Turn the table to its home position; the angle is 0 deg there.

        Raises RequestRejected where it does not come there in time, MalformedReply, NoReply, LinkError.
        """
        self._prepare()
        self._come_to_rest()
        described = self._described
        deadline_s = self._clock.now_s() + described.home_s
        try:
            self.dialogue.command(described.home, "home", self._ramp_values(), tries=1)
            while True:
                self._clock.sleep(described.line.poll_s)
                stands, angle_deg = self._stands(), self._position_deg()
                if stands and abs((angle_deg + 180) % 360 - 180) <= described.home_within_deg:
                    break
                if self._clock.now_s() > deadline_s:
                    raise RequestRejected(
                        self.name,
                        f"{'stands' if stands else 'still turns'} at {angle_deg:.4f} deg {described.home_s:g} s after "
                        f"it was sent home, instead of within {described.home_within_deg:g} deg of 0; check its home "
                        "switch, or correct home, home_s or home_within_deg in its description",
                    )
        except InstrumentError:
            self.stop()
            raise
        self._last = None

    def spin(self, rate_dps: float, steady_s: float) -> Spin:
        """Turn the table at a constant rate, deg/s, for at least `steady_s` seconds; returns when it is steady.

        Raises LimitError (nothing was sent), RequestRejected, MalformedReply, NoReply, LinkError.
        """
        demand_dps = self.achievable_dps(rate_dps)
        self._prepare()
        self._come_to_rest()
        if demand_dps != 0:
            self._rate_dps = demand_dps
            try:
                self._turn(demand_dps, steady_s)
            except InstrumentError:
                self.stop()
                raise
        angle_deg = self.read_angle()
        return Spin(rate_dps, demand_dps, angle_deg.t_s, self._clock.now_s() + steady_s + SPARE_S, angle_deg.angle_deg)

    def settle(self, spin: Spin) -> None:
        """Stop the table and return when it is at rest.

        Raises RequestRejected where it stopped by itself too early, MalformedReply, NoReply, LinkError.
        """
        if spin.rate_dps == 0:
            return
        early = not self.is_moving() and self._clock.now_s() < spin.steady_until_s - SPARE_S
        self._come_to_rest()  # the end of a finite move lies behind that of the longest wait for its rate
        if early:
            raise RequestRejected(
                self.name,
                f"stopped by itself during a run at {spin.rate_dps:g} deg/s; check load, limits and interlocks, then "
                "home the table",
            )

    def stop(self) -> None:
        """Stop the table. The command is sent before anything is asked; raises LinkError.

        A home search that another process has begun may refuse it: it is ended by what `stop_slow` describes.
        """
        described, own_run = self._described, self._rate_dps != 0
        self._rate_dps, self._last = 0.0, None
        if self.dialogue.link.awaits_slow and described.stop_slow:
            self.dialogue.stop(described.stop_slow)
            return
        self.dialogue.stop(described.stop)
        if not own_run and self._homes():
            self.dialogue.stop(described.stop_slow)

    def _homes(self) -> bool:
        """Return whether the table homes, or does not answer that; False where its description does not ask."""
        homing = self._described.homing
        try:
            return homing is not None and self.dialogue.holds(homing, "say whether it homes")
        except InstrumentError:
            return True  # it may home, and a stop that was not needed harms less

    def is_moving(self) -> bool:
        """Get whether the table moves; raises RequestRejected, MalformedReply, NoReply, LinkError."""
        return not self._stands()

    def angle_deg(self) -> float:
        """Get the table angle, degrees, unwrapped during a run; raises MalformedReply, NoReply, LinkError."""
        return self.read_angle().angle_deg

    def read_angle(self) -> AngleReading:
        """Get the position, and the middle between question and answer as its time.

        It is unwrapped from the reading before by the demanded rate. The uncertainty of the time grows with the delay
        of the answer beyond that of the quickest one so far. Raises MalformedReply, NoReply, LinkError.
        """
        sent_s = self._clock.now_s()
        angle_deg = self._position_deg()
        answered_s = self._clock.now_s()
        t_s = (sent_s + answered_s) / 2
        if self._last is not None:
            expected_deg = self._last.angle_deg + self._rate_dps * (t_s - self._last.t_s)
            angle_deg += 360.0 * round((expected_deg - angle_deg) / 360.0)
        self._quickest_s = min(self._quickest_s, answered_s - sent_s)
        u_s = math.hypot(self._described.time_u_s, (answered_s - sent_s - self._quickest_s) / math.sqrt(12))
        self._last = AngleReading(t_s, angle_deg, self._described.angle_u_deg, u_s, reply_time_u_s(answered_s - sent_s))
        return self._last

    def close(self) -> None:
        """Close the link; safe to call twice. The table goes on as commanded."""
        self.dialogue.link.close()

    def _prepare(self) -> None:
        """Send what prepares the table, once for each opening of the link, and wait until it is ready."""
        if not self.dialogue.is_new:
            return
        described = self._described
        self.dialogue.command(described.start, "prepare", self._ramp_values())
        deadline_s = self._clock.now_s() + described.ready_s
        while described.ready is not None and not self.dialogue.holds(described.ready, "say whether it is ready"):
            if self._clock.now_s() > deadline_s:
                raise RequestRejected(
                    self.name,
                    f"is not ready {described.ready_s:g} s after it was prepared; check interlocks, emergency stop and "
                    "motor power at its controller",
                )
            self._clock.sleep(described.line.poll_s)
        self.dialogue.started()

    def _turn(self, demand_dps: float, steady_s: float) -> None:
        """Begin a motion and return when its rate is reached."""
        described, sign = self._described, self.settings.direction * demand_dps
        whole_s = self._ramp_s(demand_dps) + described.settle_s + steady_s + 2 * SPARE_S + self._tolerated_s(0)
        values = {
            "rate": math.copysign(described.turning.written(abs(demand_dps)), sign),
            "speed": described.turning.written(abs(demand_dps)),
            "angle": math.copysign(described.angle.written(abs(demand_dps) * whole_s), sign),
        }
        direction = described.positive if sign > 0 else described.negative
        self.dialogue.command(described.motion, "turn", {**values, **self._ramp_values(), SIGN: direction}, tries=1)
        ramp_s = self._ramp_s(demand_dps) + described.settle_s
        sleep_until(self._clock, self._clock.now_s() + ramp_s)
        deadline_s = self._clock.now_s() + END_TOLERANCE_SHARE * ramp_s + END_TOLERANCE_S / 2
        while True:
            found_dps, within = self._measured_dps(demand_dps)
            if self.is_moving() and abs(found_dps - demand_dps) <= within * abs(demand_dps):
                return
            if self._clock.now_s() > deadline_s:
                raise RequestRejected(
                    self.name,
                    f"turns at {found_dps:.4g} deg/s instead of {demand_dps:g} deg/s (limit {100 * within:g} %); "
                    "check load and limits of the controller, and units and signs in its description",
                )
            self._clock.sleep(described.line.poll_s)

    def _measured_dps(self, demand_dps: float) -> tuple[float, float]:
        """Return the rate, deg/s, by the controller or by two positions, and the share by which it may be off."""
        described = self._described
        if described.rate is not None:
            rate_dps = described.turning.read(self.dialogue.number(described.rate, "read its rate"))
            return self.settings.direction * rate_dps, described.rate_within
        first = self.read_angle()
        self._clock.sleep(min(MEASURED_OVER_S, MEASURED_OVER_DEG / abs(demand_dps)))
        last = self.read_angle()
        return (last.angle_deg - first.angle_deg) / (last.t_s - first.t_s), max(described.rate_within, COARSE_WITHIN)

    def _come_to_rest(self) -> None:
        """Stop the table unless it stands, and wait until it does."""
        if self.is_moving():
            self.stop()
            self._await_rest(self._clock.now_s() + self._ramp_s(self.settings.max_rate_dps))
        self._rate_dps, self._last = 0.0, None

    def _await_rest(self, due_s: float) -> None:
        deadline_s = due_s + self._tolerated_s(max(due_s - self._clock.now_s(), 0.0))
        while self.is_moving():
            if self._clock.now_s() > deadline_s:
                self.stop()
                raise NoReply(
                    self.name, "the table still turns after it should stand; switch the table's power off by hand"
                )
            self._clock.sleep(self._described.line.poll_s)

    def _stands(self) -> bool:
        described = self._described
        return self.dialogue.holds(described.standing, "say whether it stands")

    def _position_deg(self) -> float:
        number = self.dialogue.number(self._described.position, "read its position")
        return self.settings.direction * self._described.angle.read(number)

    def _ramp_values(self) -> dict[str, float]:
        return {"acceleration": self._described.accelerating.written(self.settings.acceleration_dps2)}

    def _ramp_s(self, rate_dps: float) -> float:
        return abs(rate_dps) / self.settings.acceleration_dps2

    @staticmethod
    def _tolerated_s(duration_s: float) -> float:
        return END_TOLERANCE_S + END_TOLERANCE_SHARE * duration_s


DRIVER = TableDriver(
    DescribedTableSettings,
    DescribedTable,
    Trial("servo-sim", {"host": "sim://acutrol-3000", "format": "acutrol-3000"}, table={"plain_lines": True}),
)

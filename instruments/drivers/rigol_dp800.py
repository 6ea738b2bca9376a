"""Rigol DP800 power supplies: the voltage of the units is limited, set with a current limit, and read back."""

from __future__ import annotations

from instruments.clock import Clock
from instruments.drivers.driver import SupplyDriver, Trial
from instruments.drivers.serial_numbers import refuse_other_serial
from instruments.errors import LimitError, RequestRejected, WrongInstrument
from instruments.interfaces.gyro import Channel
from instruments.interfaces.reference import ReferenceState
from instruments.interfaces.supply import SupplyLimits
from instruments.protocols import rigol_dp800 as dp800
from instruments.protocols.rigol_dp800 import Dp800Settings
from instruments.transport.factory import Ports
from instruments.transport.line_link import LineLink
from instruments.transport.serial_stream import line_of

#: A reading is kept as a whole number of this, V.
READING_V = 1e-4


class RigolDp800:
    """Driver of one channel of a DP800."""

    name = "supply"

    def __init__(self, settings: Dp800Settings, ports: Ports, clock: Clock) -> None:
        self._settings, self._clock = settings, clock
        self.limits = SupplyLimits(
            settings.nominal_v, settings.min_v, settings.max_v, settings.current_limit_a, settings.tolerance_v
        )
        self.safe_state: str = settings.safe_state
        self.channels: tuple[Channel, ...] = (Channel(settings.column, "V", READING_V),)
        self._lines = LineLink(
            self.name, settings.address_url, ports, clock, dp800.SYNTAX, baudrate=settings.baudrate,
            line=line_of(settings.options),
        )  # fmt: skip
        self._channel = settings.channel
        self._resolution_v: float | None = None
        self._given_v: float | None = None  #: what the output is at, by this driver; None before, and when it is off
        self._arrived = False

    def identify(self) -> str:
        """Get model and serial number.

        Raises WrongInstrument for another instrument, and for a channel that cannot give what the bench file says;
        MalformedReply, NoReply, LinkError.
        """
        reply = self._lines.ask(dp800.IDENTITY, r".*\S.*", "say what it is")[0]
        refuse_other_serial(self.name, reply, self._settings.serial, holds_serial=True)
        self._resolution_v = dp800.resolution_v(self._model_in(reply))
        return reply.strip()

    def is_on(self) -> bool:
        """Get whether the output is on; raises MalformedReply, NoReply, LinkError."""
        reply = self._lines.ask(f":OUTP? CH{self._channel}", r"\s*(?P<on>ON|OFF)\s*", "say whether it is on")
        return reply["on"] == "ON"

    def set_voltage_v(self, voltage_v: float) -> float:
        """Set the voltage, with the current limit, and switch the output on; returns the set point read back, V.

        Raises LimitError (nothing was sent), RequestRejected where the supply refuses or reports another set point,
        MalformedReply, NoReply, LinkError.
        """
        set_v = self._apply(voltage_v)
        if not self.is_on():
            self._command(f":OUTP CH{self._channel},ON", "switch the output on")
            if not self.is_on():
                raise RequestRejected(
                    self.name,
                    f"the output is off after it was switched on: {self._why()}; clear the protection at the panel, "
                    "and check the load",
                )
        self._given_v = set_v
        return set_v

    def switch_off(self) -> None:
        """Switch the output off, and read that back; raises RequestRejected, MalformedReply, NoReply, LinkError."""
        self._given_v = None
        self._command(f":OUTP CH{self._channel},OFF", "switch the output off")
        if self.is_on():
            raise RequestRejected(
                self.name, "the output is on after it was switched off; switch it off at the panel of the supply"
            )

    def read(self) -> ReferenceState:
        """Get the measured voltage.

        Raises RequestRejected where it left the voltage that was set, once it had arrived there, or where a protection
        has tripped; MalformedReply, NoReply, LinkError.
        """
        measured_v = self._measured_v()
        if self._given_v is not None:
            self._demand(measured_v, self._given_v)
        return ReferenceState(self._clock.now_s(), {self.channels[0].name: round(measured_v / READING_V)})

    def make_safe(self) -> float:
        """Set the supply to its safe state; returns the set point read back, V, 0 with the output off.

        Switches nothing on. Raises as `set_voltage_v` does.
        """
        if self.safe_state == "off":
            self.switch_off()
            return 0.0
        set_v = self._apply(self.limits.nominal_v)
        self._given_v = set_v if self.is_on() else None
        return set_v

    def close(self) -> None:
        """Close the link; safe to call twice. The supply keeps its output."""
        self._lines.close()

    def _apply(self, voltage_v: float) -> float:
        """Write voltage, current limit and overvoltage protection; returns the voltage read back."""
        if (text := self.limits.complaint(voltage_v)) is not None:
            raise LimitError(
                self.name, f"set point {text}; nothing was sent: ask for a voltage within min_v and max_v of [supply]"
            )
        self._forget_errors()
        limit_a, channel = self.limits.current_limit_a, self._channel
        self._given_v, self._arrived = None, False
        self._command(dp800.apply(channel, voltage_v, limit_a), f"set {voltage_v:g} V")
        self._command(f":OUTP:OVP:VAL CH{channel},{dp800.OVP_SHARE * self.limits.max_v:.2f}", "set its protection")
        self._command(f":OUTP:OVP CH{channel},ON", "switch its overvoltage protection on")
        reply = self._lines.ask(f":APPL? CH{channel}", dp800.setting_reply(channel), "read its set point")
        set_v, set_a = float(reply["v"]), float(reply["a"])
        half_step = self._step_v() / 2 + 1e-9
        if abs(set_v - voltage_v) > half_step or abs(set_a - limit_a) > half_step:
            raise RequestRejected(
                self.name,
                f"{voltage_v:g} V and at most {limit_a:g} A were set, but it reports {set_v:g} V and {set_a:g} A; "
                "unlock its panel and end its timer or delayer",
            )
        return set_v

    def _step_v(self) -> float:
        if self._resolution_v is None:
            self.identify()
        return self._resolution_v or 0.0

    def _model_in(self, reply: str) -> str:
        """Return the model in an identification; raises WrongInstrument."""
        wanted, settings = self._channel, self._settings
        model = dp800.model_in(reply)
        channels = dp800.MODELS.get(model)
        if channels is None or wanted not in channels:
            raise WrongInstrument(
                self.name,
                f"{settings.address_url} is {reply.strip()!r}, channel {wanted}; this driver drives channels of "
                f"{', '.join(dp800.MODELS)} with a positive voltage: correct address, driver or channel",
            )
        limit = channels[wanted]
        if settings.max_v > limit.max_v or settings.current_limit_a > limit.max_a:
            raise WrongInstrument(
                self.name,
                f"max_v = {settings.max_v:g} V and current_limit_a = {settings.current_limit_a:g} A in the bench "
                f"file, but channel {wanted} of a {model} gives at most {limit.max_v:g} V and {limit.max_a:g} A; "
                "correct them",
            )
        return model

    def _measured_v(self) -> float:
        request = f":MEAS:VOLT? CH{self._channel}"
        return float(self._lines.ask(request, rf"\s*(?P<v>{dp800.NUMBER})\s*", "measure its voltage")["v"])

    def _register(self) -> int:
        request = f":STAT:QUES:INST:ISUM{self._channel}:COND?"
        return int(self._lines.ask(request, r"\s*(?P<bits>\d+)\s*", "say how it controls the output")["bits"])

    def _why(self) -> str:
        return dp800.why_off(self._register())

    def _demand(self, measured_v: float, given_v: float) -> None:
        """Raise RequestRejected where the output is not where it was set to, and is not on its way there."""
        if abs(measured_v - given_v) <= self.limits.tolerance_v:
            self._arrived = True
            return
        register = self._register()
        if self._arrived or register & (dp800.OVER_VOLTAGE | dp800.OVER_CURRENT):
            raise RequestRejected(
                self.name,
                f"the output is at {measured_v:g} V instead of {given_v:g} V, limit {self.limits.tolerance_v:g} V off: "
                f"{dp800.why_off(register)}; check load, cable and panel of the supply",
            )

    def _command(self, command: str, purpose: str) -> None:
        """Send a command, and ask whether it was an error; raises RequestRejected."""
        self._lines.tell(command, purpose)
        reply = self._lines.ask(dp800.ERROR, dp800.ERROR_REPLY, "say whether a command was an error")
        if float(reply["code"]):
            raise RequestRejected(
                self.name,
                f"refused to {purpose}: error {reply['code']} {reply['why']!r} after {command!r}; check its mode and "
                "limits at its panel",
            )

    def _forget_errors(self) -> None:
        """Read the errors of earlier commands, which this driver did not cause."""
        for _ in range(dp800.MAX_ERRORS + 1):
            if not float(self._lines.ask(dp800.ERROR, dp800.ERROR_REPLY, "say what errors it holds")["code"]):
                return
        raise RequestRejected(
            self.name, f"holds more than {dp800.MAX_ERRORS} errors; clear them by *CLS, or switch it off and on"
        )


#: What the trial's bench file says.
TRIAL = {"host": "sim://rigol-dp800", "nominal_v": 5.0, "min_v": 4.5, "max_v": 5.5, "current_limit_a": 1.0}
DRIVER = SupplyDriver(Dp800Settings, RigolDp800, Trial(section=TRIAL))

"""Base of the chamber drivers: a set point is limited, rounded, written on change only and read back."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import Protocol

from instruments.bench_config import ChamberSettings
from instruments.clock import Clock
from instruments.errors import LimitError, RequestRejected, WrongInstrument
from instruments.interfaces.chamber import ChamberLimits, ChamberState

#: Rounding of counts and floats; far below any set point's resolution.
TINY_C = 1e-6
#: Asking whether a set point has an effect takes at most one of so many seconds: units are not read meanwhile.
SLOW_SHARE = 50.0


class Link(Protocol):
    """The part of a link that every chamber uses."""

    def close(self) -> None:
        """Close the link; safe to call twice."""
        ...


class SetpointChamber(ABC):
    """A chamber whose controller is given set points.

    The controller's limits are read once; the narrower of controller and bench file apply. A profile on the controller
    belongs to a person: the driver does not end it in favour of its own set point. Only `make_safe` ends a profile, and
    only on a chamber that this driver has controlled before.
    """

    name = "chamber"

    def __init__(self, settings: ChamberSettings, link: Link, clock: Clock) -> None:
        self._own_settings = settings
        self.safe_c = settings.safe_c
        self._link, self._clock = link, clock
        self._limits: ChamberLimits | None = None
        self._has_controlled = False
        self._given_c: float | None = None  #: the set point that the controller took last from this driver
        self._found_hindrance, self._ask_again_s = "", 0.0
        self._request_s = math.inf  #: shortest time so far of asking whether a set point has an effect

    #: Whether `_switch_on` can switch control on; False where only a person can.
    switches_on = True

    @property
    def limits(self) -> ChamberLimits:
        """Get the narrower limits of controller and bench file; the first use reads the controller and may raise."""
        if self._limits is None:
            low, high = self._controller_limits()
            settings = self._own_settings
            self._limits = ChamberLimits(
                max(low, settings.min_c), min(high, settings.max_c), self._resolution_c(), settings.ramp_c_per_min
            )
        return self._limits

    @abstractmethod
    def identify(self) -> str:
        """Get model or part number; raises WrongInstrument for another controller or units other than Celsius."""

    @abstractmethod
    def _controller_limits(self) -> tuple[float, float]:
        """Return the controller's own set-point limits, deg C."""

    @abstractmethod
    def _resolution_c(self) -> float:
        """Return the step of a set point, deg C."""

    @abstractmethod
    def _write_setpoint(self, temperature_c: float) -> None:
        """Write a rounded set point."""

    @abstractmethod
    def _read_setpoint(self) -> float:
        """Return the set point, deg C."""

    @abstractmethod
    def _read_air(self) -> float:
        """Return the air temperature, deg C; raises MalformedReply when the controller marks it invalid."""

    @abstractmethod
    def _alarms(self) -> tuple[str, ...]:
        """Return the active alarms, one text each."""

    @abstractmethod
    def _profile_runs(self) -> bool:
        """Return whether a profile runs or is held: a static set point then has no effect."""

    @abstractmethod
    def _end_profile(self) -> None:
        """Terminate the profile."""

    def _stopped(self) -> str:
        """Return what shows that heating and cooling are off; an empty text where they are on or nothing shows it."""
        return ""

    @abstractmethod
    def _start(self) -> None:
        """Switch control on. Called where `_stopped` says that it is off and `switches_on` that this driver can."""

    def _switch_on(self) -> None:
        """Switch control on where it is off; raises RequestRejected where only a person may do that."""
        stopped = self._stopped()
        if stopped and not self.switches_on:
            raise RequestRejected(self.name, f"{stopped}; switch it on at its panel")
        if stopped:
            self._start()

    def set_temperature_c(self, temperature_c: float) -> float:
        """Write the set point: limited, rounded, written on change only (EEPROM wear); returns the value read back.

        Raises LimitError (nothing was written), RequestRejected while a profile runs or when another value is read
        back, and what an exchange with the controller raises.
        """
        rounded = self._checked(temperature_c)
        self._refuse_without_effect()
        self._switch_on()
        self._has_controlled = True
        return self._write_and_verify(rounded)

    def make_safe(self) -> float:
        """Set the chamber to its safe set point; returns the value read back, deg C. Switches nothing on.

        Raises as `set_temperature_c` does.
        """
        rounded = self._checked(self.safe_c)
        if self._has_controlled and self._profile_runs():
            self._end_profile()
        self._refuse_without_effect()
        return self._write_and_verify(rounded)

    def read(self) -> ChamberState:
        """Get air temperature, set point (deg C), alarms and foreign changes; raises what an exchange raises."""
        now_s, air_c, setpoint_c = self._clock.now_s(), self._read_air(), self._read_setpoint()
        return ChamberState(now_s, air_c, setpoint_c, self._alarms(), self._given_c, self._foreign(setpoint_c))

    def shortcomings(self) -> tuple[str, ...]:
        """Get why a set point would have no effect, and what to do; raises what a read of the controller raises."""
        hindrance = self._hindrance()
        if not hindrance and not self.switches_on and (stopped := self._stopped()):
            hindrance = f"{stopped}, so a set point would have no effect; switch it on at its panel"
        return tuple(filter(None, [hindrance]))

    def close(self) -> None:
        """Close the link. The controller keeps its set point."""
        self._link.close()

    def _checked(self, temperature_c: float) -> float:
        limits = self.limits
        low, high = limits.min_c - TINY_C, limits.max_c + TINY_C
        # the last rounding removes the remainder of the multiplication: 85.1, not 85.10000000000001
        step = limits.resolution_c
        rounded = round(round(temperature_c / step) * step, 6) + 0.0 if low <= temperature_c <= high else temperature_c
        if not low <= rounded <= high:
            raise LimitError(
                self.name,
                f"set point {temperature_c:g} deg C lies outside the limits, {limits.min_c:g} to "
                f"{limits.max_c:g} deg C (the narrower of those of the controller and of the bench file); nothing was "
                "written: ask for a set point within these limits",
            )
        return rounded

    def _hindrance(self) -> str:
        """Return why a set point would have no effect, and what to do; an empty text where it has one."""
        if self._profile_runs():
            return (
                "a profile is running or held on the controller, so a set point would have no effect; end "
                "the profile at the panel of the controller"
            )
        return ""

    def _foreign(self, setpoint_c: float) -> tuple[str, ...]:
        """Return what others have changed since this driver gave a set point; nothing before it did."""
        if self._given_c is None:
            return ()
        if (asked_s := self._clock.now_s()) >= self._ask_again_s:
            self._found_hindrance = self._hindrance()
            # the shortest: a computer that is busy makes one request slow, and no chamber
            self._request_s = min(self._request_s, self._clock.now_s() - asked_s)
            self._ask_again_s = asked_s + SLOW_SHARE * self._request_s
        # a program has a state of its own: a controller that runs one is not in its manual mode, and yet not off
        stopped = "" if self._found_hindrance or not self._has_controlled else self._stopped()
        hindrances = [self._found_hindrance, stopped]
        if abs(setpoint_c - self._given_c) > self.limits.resolution_c / 2 + TINY_C:
            hindrances.append(f"the set point is {setpoint_c:g} deg C, labctl gave {self._given_c:g} deg C")
        return tuple(filter(None, hindrances))

    def _refuse_without_effect(self) -> None:
        if hint := self._hindrance():
            raise RequestRejected(self.name, f"{hint}")

    def _write_and_verify(self, rounded_c: float) -> float:
        self._given_c, self._ask_again_s = None, 0.0
        if abs(self._read_setpoint() - rounded_c) > TINY_C:
            self._write_setpoint(rounded_c)
        setpoint_c = self._read_setpoint()
        if abs(setpoint_c - rounded_c) > self.limits.resolution_c / 2:
            raise RequestRejected(
                self.name,
                f"set point {rounded_c:g} deg C was written, but the controller reports {setpoint_c:g} deg C; set "
                "the controller to its run page",
            )
        self._given_c = setpoint_c
        return setpoint_c

    def _wrong(self, text: str) -> WrongInstrument:
        return WrongInstrument(self.name, text)

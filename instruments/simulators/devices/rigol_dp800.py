"""A simulated Rigol DP800: one channel supplies the units, and what it does is felt by the simulated world."""

from __future__ import annotations

import re
from collections import deque

import numpy as np

from instruments.bench_config import part_of
from instruments.protocols.rigol_dp800 import (
    CURRENT_LIMITED,
    MAX_ERRORS,
    MODELS,
    OVER_VOLTAGE,
    SYNTAX,
    VOLTAGE_CONTROLLED,
    Dp800Settings,
)
from instruments.simulators.links.line_device import LineDevice
from instruments.simulators.setup import InstrumentSetup

NO_ERROR, UNDEFINED, OUT_OF_RANGE = '0,"No error"', '-113,"Undefined header"', '-222,"Data out of range"'
APPLY = re.compile(r":APPL CH(\d),([\d.]+),([\d.]+)")
OUTPUT = re.compile(r":OUTP CH(\d),(ON|OFF)")
OVP_VALUE = re.compile(r":OUTP:OVP:VAL CH(\d),([\d.]+)")
OVP_STATE = re.compile(r":OUTP:OVP CH(\d),(ON|OFF)")
#: With the current limited, the output falls to this share of its set point.
LIMITED_SHARE = 0.6


class SimulatedDp800(LineDevice):
    """`load_a` is what the units draw; faults: refusal (an error is queued), stall (a command has no effect)."""

    reply_end = "\n"

    def __init__(self, setup: InstrumentSetup) -> None:
        super().__init__(SYNTAX, setup.faults)
        settings = part_of(setup.instrument("supply"), Dp800Settings)
        self._world, self._channel = setup.world, settings.channel
        self.model, self.serial = "DP832A", settings.serial or "DP8A000000001"
        self.volts, self.amps, self.on = settings.nominal_v, settings.current_limit_a, True
        self.load_a = 0.2
        self._ovp_v, self._ovp_on, self._tripped = 33.0, False, False
        self._was_powered = False
        self._errors: deque[str] = deque(maxlen=MAX_ERRORS)

    def answer(self, request: str, t_s: float) -> str | None:
        """Return the reply to a question; carry a command out, which has none."""
        if "?" in request:
            return self._question(request, t_s)
        if self.faults.trigger(["refusal"], t_s) is not None:
            self._errors.append(OUT_OF_RANGE)
        elif self.faults.trigger(["stall"], t_s) is None:
            self._carry_out(request, t_s)
        return None

    def turn_knob(self, t_s: float, volts: float) -> None:
        """Set another voltage as a person at the panel does."""
        self.volts = volts
        self._follow(t_s)

    @property
    def output_v(self) -> float:
        """What the output settles at, V."""
        if not self.on:
            return 0.0
        return self.volts if self.load_a <= self.amps else LIMITED_SHARE * self.volts

    def _question(self, request: str, t_s: float) -> str | None:
        n = self._channel
        decimals = 4 if self.model.endswith("A") else 2
        measured_v = float(self._world.supply_v(np.array([t_s]))[0])
        answers = {
            "*IDN?": f"RIGOL TECHNOLOGIES,{self.model},{self.serial},00.01.16",
            f":APPL? CH{n}": f"CH{n}:30V/3A,{self.volts:.3f},{self.amps:.3f}",
            f":OUTP? CH{n}": "ON" if self.on else "OFF",
            f":MEAS:VOLT? CH{n}": f"{measured_v:.{decimals}f}",
            f":STAT:QUES:INST:ISUM{n}:COND?": str(self._register),
        }
        if request == ":SYST:ERR?":
            return self._errors.popleft() if self._errors else NO_ERROR
        if request not in answers:
            self._errors.append(UNDEFINED)
        return answers.get(request)

    @property
    def _register(self) -> int:
        if self._tripped:
            return OVER_VOLTAGE
        if not self.on:
            return 0
        return VOLTAGE_CONTROLLED if self.load_a <= self.amps else CURRENT_LIMITED

    def _carry_out(self, command: str, t_s: float) -> None:
        if (match := APPLY.fullmatch(command)) and int(match[1]) == self._channel:
            limit = MODELS[self.model][self._channel]
            if float(match[2]) > limit.max_v or float(match[3]) > limit.max_a:
                self._errors.append(OUT_OF_RANGE)
                return
            self.volts, self.amps = float(match[2]), float(match[3])
        elif (match := OUTPUT.fullmatch(command)) and int(match[1]) == self._channel:
            self._switch(t_s, on=match[2] == "ON")
        elif (match := OVP_VALUE.fullmatch(command)) and int(match[1]) == self._channel:
            self._ovp_v = float(match[2])
        elif (match := OVP_STATE.fullmatch(command)) and int(match[1]) == self._channel:
            self._ovp_on = match[2] == "ON"
        else:
            self._errors.append(UNDEFINED)
        self._follow(t_s)

    def _switch(self, t_s: float, *, on: bool) -> None:
        """Switch the output, and with it the units, whose own switch stays as it is."""
        if on == self.on:
            return
        self.on, self._tripped = on, False
        if not on:
            self._was_powered = self._world.powered_on_s is not None
            self._world.power(t_s, on=False)
        elif self._was_powered:
            self._world.power(t_s, on=True)

    def _follow(self, t_s: float) -> None:
        """Have the output follow what was set, or trip."""
        if self.on and self._ovp_on and self.output_v > self._ovp_v:
            self._switch(t_s, on=False)
            self._tripped = True
        if self._world.supply is not None:
            self._world.supply.set(t_s, self.output_v)

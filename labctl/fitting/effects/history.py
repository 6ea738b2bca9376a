"""What came before: time, power-ons, re-mountings, the rate before this one."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from labctl.answers.fitted_model import Origin
from labctl.fitting.data.channels import Channels
from labctl.fitting.data.rate_profile import Response
from labctl.fitting.effects.base import Column, Effect, Parameter, Reference, Rows, Span, Term, by_parameter


class BiasDrift(Effect):
    """Ramp of the bias with time."""

    id = "bias_drift"
    in_use = False
    term = "Bias ramp (drift, aging)"
    sentence = "The bias drifts in one direction during the whole campaign."
    origin: ClassVar[Origin] = "sensor"
    rows: ClassVar[Rows] = "all"
    shows_at_rest = True
    needs = ("t_s",)
    ranges: ClassVar = {"fog": (0.0, 0.005), "mems": (0.0, 0.02), "piezo": (0.0, 0.5)}
    experiment = "the first temperature repeated at the end; a long record at rest"
    draws = ("time", "repeats", "legs")

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        since_middle_s = channels.recording_t_s() - channels.history.middle_s
        return [Column("bias_drift", "deg/s/h", since_middle_s / 3600.0)]


class _Shift(Effect):
    counted: ClassVar[str]
    rows: ClassVar[Rows] = "all"
    shows_at_rest = True

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        later = channels.history.numbers(self.counted)[1:]
        numbers = np.asarray(channels[self.counted]) if later else np.zeros(len(channels))
        return [
            Column(f"{self.counted}_{int(number)}", "deg/s", (numbers == number).astype(np.float64)) for number in later
        ]


class RunShift(_Shift):
    """Turn-on to turn-on bias repeatability."""

    id = "run_shift"
    term = "Turn-on to turn-on bias repeatability"
    sentence = "The bias is slightly different after each power-on."
    origin: ClassVar[Origin] = "environment"
    needs = ("run",)
    counted = "run"
    ranges: ClassVar = {"fog": (0.0, 0.01), "mems": (0.0, 0.1), "piezo": (0.0, 0.5)}
    experiment = "at least two power cycles in each mounting"
    draws = ("time", "repeats")


class MountingShift(_Shift):
    """Change with re-mounting."""

    id = "mounting_shift"
    term = "Mounting repeatability"
    sentence = "The output at rest is slightly different after each re-mounting."
    origin: ClassVar[Origin] = "fixture"
    needs = ("mounting",)
    counted = "mounting"
    ranges: ClassVar = {"fog": (0.0, 0.01), "mems": (0.0, 0.1), "piezo": (0.0, 0.5)}
    experiment = "both mountings in one powered run"
    draws = ("time", "map")


class RateHysteresis(Effect):
    """Memory of the previous rate."""

    id = "rate_hysteresis"
    in_use = False
    term = "Rate hysteresis"
    sentence = "The output depends on the previous rate."
    origin: ClassVar[Origin] = "sensor"
    rows: ClassVar[Rows] = "all"
    needs = ("t_s",)
    parameters = (Parameter("by_sign", "1", 0, 1),)
    ranges: ClassVar = {"fog": (0.0, 0.01), "mems": (0.0, 0.05), "piezo": (0.0, 0.2)}
    experiment = "rates in random order, each approached from both sides"
    draws = ("previous_rate",)

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        before = np.asarray(channels["previous_rate_dps"], dtype=np.float64)
        soft = term.parameters.get("by_sign", 0.0)
        shape = before / channels.history.rate_dps if not soft else np.tanh(soft * before / channels.history.rate_dps)
        return [Column("previous_rate", "deg/s", shape)]

    def options(self, span: Span) -> list[Term]:
        return by_parameter(self.id, by_sign=np.array([0.0, 3.0, 20.0]))


class StartTransient(Effect):
    """Start transient."""

    id = "start_transient"
    in_use = False
    term = "Start transient (bandwidth, latency, spin-up)"
    sentence = "After each change of the rate, the output takes some seconds to settle."
    origin: ClassVar[Origin] = "sensor"
    rows: ClassVar[Rows] = "all"
    needs = ("t_s",)
    parameters = (Parameter("tau_s", "s", 0.5, 20.0, logarithmic=True),)
    ranges: ClassVar = {"fog": (0.0, 0.05), "mems": (0.0, 0.05), "piezo": (0.0, 0.2)}
    experiment = "a longer wait before each data set; compare the first seconds of all data sets"
    draws = ("time_in_set", "previous_rate")

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        tau_s = term.parameters.get("tau_s", 4.0)
        if channels.profile is not None:  # the rate changes all the time, and the output creeps after it
            crept = channels.profile.seen_dps(Response(0.0, tau_s)) - channels.profile.seen_dps(Response())
            return [Column("start_of_rate", "1", channels.up(axis) * crept)]
        decay = channels.decayed(tau_s)
        before = np.asarray(channels["previous_rate_dps"], dtype=np.float64) * channels.up(axis)
        return [
            Column("start_of_rate", "1", -channels.rate_dps(axis) * decay),
            Column("start_from_rate", "1", before * decay),
        ]

    def options(self, span: Span) -> list[Term]:
        return by_parameter(self.id, tau_s=np.geomspace(1.5, 15.0, 4))


EFFECTS: tuple[type[Effect], ...] = (
    BiasDrift,
    RunShift,
    MountingShift,
    RateHysteresis,
    StartTransient,
)

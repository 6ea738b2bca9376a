"""What came before: time, power-ons, re-mountings, the rate before this one."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from labctl.fitting.data.channels import Channels
from labctl.fitting.data.response import Response
from labctl.fitting.effects.base import Column, Effect, Parameter, Reference, Rows, Span, Term, by_parameter
from labctl.fitting.effects.equation import IEEE_952, Equation, Source, Symbol, term_528

if TYPE_CHECKING:
    from labctl.answers.effect_origin import Origin


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
    equation: ClassVar = Equation(
        "R * (t - t_m) / 3600",
        (Symbol("R", "rate ramp", "deg/s/h", "bias_drift"),),
        others=(Symbol("t_m", "middle of the recording", "s"),),
    )
    sources: ClassVar = (Source(IEEE_952, "Annex C.1.4, rate ramp"),)

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        since_middle_s = channels.recording_t_s() - channels.history.middle_s
        return [Column("bias_drift", "deg/s/h", since_middle_s / 3600.0)]


class _Shift(Effect):
    counted: ClassVar[str]
    is_random = True
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
    equation: ClassVar = Equation(
        "b[r]",
        (Symbol("b[r]", "bias of powered run r less that of the first; 0 for the first", "deg/s", "run_{r}"),),
        others=(Symbol("r", "number of the powered run", "", "run"),),
    )
    sources: ClassVar = (term_528("repeatability"),)


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
    equation: ClassVar = Equation(
        "b[m]",
        (
            Symbol(
                "b[m]", "output at rest in mounting m less that in the first; 0 for the first", "deg/s", "mounting_{m}"
            ),
        ),
        others=(Symbol("m", "number of the mounting", "", "mounting"),),
    )
    sources: ClassVar = (term_528("repeatability"),)


class RateHysteresis(Effect):
    """Memory of the previous rate."""

    id = "rate_hysteresis"
    in_use = False
    term = "Rate hysteresis"
    sentence = "The output depends on the previous rate."
    origin: ClassVar[Origin] = "sensor"
    rows: ClassVar[Rows] = "all"
    needs = ("t_s",)
    parameters = (
        Parameter(
            "by_sign",
            "1",
            0,
            1,
            symbol="c",
            meaning="how sharply the sign of the rate before decides; 0: the error is proportional to that rate",
        ),
    )
    ranges: ClassVar = {"fog": (0.0, 0.01), "mems": (0.0, 0.05), "piezo": (0.0, 0.2)}
    experiment = "rates in random order, each approached from both sides"
    draws = ("previous_rate",)
    equation: ClassVar = Equation(
        "h * tanh(c * omega_b / omega_max) if c > 0 else h * omega_b / omega_max",
        (Symbol("h", "error after the largest rate", "deg/s", "previous_rate"),),
    )
    sources: ClassVar = (term_528("hysteresis error"),)

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
    parameters = (
        Parameter(
            "tau_s",
            "s",
            0.5,
            20.0,
            logarithmic=True,
            symbol="tau",
            meaning="time constant of the settling after a change of the rate",
        ),
    )
    ranges: ClassVar = {"fog": (0.0, 0.05), "mems": (0.0, 0.05), "piezo": (0.0, 0.2)}
    experiment = "a longer wait before each data set; compare the first seconds of all data sets"
    draws = ("time_in_set", "previous_rate")
    equation: ClassVar = Equation(
        "(s_b * omega_b * u[a] - s_n * omega[a]) * E",
        (
            Symbol("s_b", "share of the rate before that is left at the start", "1", "start_from_rate"),
            Symbol("s_n", "share of the present rate that is missing at the start", "1", "start_of_rate"),
        ),
        where=(("E", "tau / L * (exp(-t_d / tau) - exp(-(t_d + L) / tau))"),),
        others=(
            Symbol("E", "mean of exp(-time / tau) over the row", "1"),
            Symbol("t_d", "start of the row since the start of its data set", "s", "since_begin_s"),
            Symbol("L", "duration of the row", "s", "duration_s"),
        ),
    )
    sources: ClassVar = (term_528("time constant"),)

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

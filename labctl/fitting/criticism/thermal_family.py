"""The thermal response of a unit at rest as one family: lag, rate of change and hysteresis are its members.

Each member resembles the others on one course of the temperature, so that of two which are there one alone takes the
place of both, and leaves much: a lag and a hysteresis together are tried as one response too. Self-heating and warm-up
go by the time since power-on and stay effects of their own, beside which the response is sought. What is certain is how
well the response predicts stretches that it has not seen, and its time constants; which member it is may not be, and
then is not claimed.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from labctl.answers.criticism import Advice
from labctl.answers.fitted_model import Coefficient, ThermalFamilyJson, ThermalHintJson
from labctl.fitting.criticism.verdict import Form, Verdict
from labctl.fitting.data.fit_data import FitData
from labctl.fitting.effects import CATALOGUE, Span, Term
from labctl.fitting.estimation.thermal_flows import NONE, STRUCTURES, Axis, LeftOut, best_taus, left_out_by, pooled
from labctl.fitting.estimation.thermal_response import SEEN, ThermalResponse, stretches_of, thermal_response
from labctl.fitting.models.error_model import ErrorModel
from labctl.probability_text import share_text

LAG = "thermal_lag"
#: The members beside the lag, and all of them.
RIVALS = ("temperature_rate", "thermal_hysteresis")
FAMILY = frozenset({LAG, *RIVALS})
#: A response is there where it leaves less than this share of the chi2 of stretches left out, and may be there where it
#: leaves less than the second.
MAX_REMAINING, MAX_REMAINING_OF_HINT = 0.25, 0.75
#: The member that is tried beside a lag, and chi2 over the noise that the better one of both leaves alone at least: a
#: member whose true shape is another one, such as a hysteresis without corners, leaves less.
BESIDE, MIN_LEFT_ALONE = "thermal_hysteresis", 1.5


@dataclass(frozen=True)
class ThermalFamily:
    """A thermal response that predicts what it has not seen."""

    response: ThermalResponse
    rivals: Mapping[str, LeftOut] = field(default_factory=dict)  #: what each other member leaves alone
    shapes: dict[str, Coefficient] = field(default_factory=dict)  #: time constants with u, where they were asked for
    beside: Term | None = None  #: the member that is there beside the lag
    alone: LeftOut | None = None  #: what the better one of both leaves alone

    @property
    def alike(self) -> tuple[str, ...]:
        """The members that predict as well, alone."""
        return tuple(name for name, rival in self.rivals.items() if not self.after.is_below(rival))

    @property
    def is_certain(self) -> bool:
        """Whether it predicts so much that it is named, as two members together always do; else it is a hint."""
        return self.beside is not None or self.after.chi2 <= MAX_REMAINING * self.before.chi2

    def with_shapes(self, shapes: Mapping[str, dict[str, Coefficient]]) -> ThermalFamily:
        """Return the same with the time constants of a fit with it, effect -> name -> value with u."""
        return replace(self, shapes=shapes.get(LAG, {}))

    @property
    def before(self) -> LeftOut:
        """What the model leaves without it."""
        return self.response.held_out[NONE.id]

    @property
    def after(self) -> LeftOut:
        """What it leaves."""
        return self.response.held_out[self.response.structure.id]

    @property
    def advice(self) -> Advice:
        """To add it: it was chosen by what it leaves of stretches left out."""
        return Advice(
            effect=LAG, add=True, checked=True, why="", before_dps=self.before.rms_dps, after_dps=self.after.rms_dps
        )  # fmt: skip

    @property
    def advice_beside(self) -> tuple[Advice, ...]:
        """To add what is there beside the lag; empty where nothing is."""
        if self.beside is None or self.alone is None:
            return ()
        name, before, after = self.beside.effect, self.alone.rms_dps, self.after.rms_dps
        return (Advice(effect=name, add=True, checked=True, why="", before_dps=before, after_dps=after),)

    @property
    def terms(self) -> tuple[Term, ...]:
        """The lag, and what is there beside it."""
        return (self.response.term, *(() if self.beside is None else (self.beside,)))

    def to_json(self) -> ThermalFamilyJson:
        """Return this as JSON."""
        return {
            "structure": self.response.structure.id, "time_constants": self.shapes, "alike": list(self.alike),
            "before_rms_dps": self.before.rms_dps, "after_rms_dps": self.after.rms_dps,
            "beside": [term.effect for term in self.terms[1:]],
        }  # fmt: skip

    def hint_json(self) -> ThermalHintJson:
        """Return this as JSON, with why it is not certain."""
        return {
            **self.to_json(), "rivals_rms_dps": {name: rival.rms_dps for name, rival in self.rivals.items()},
            "why": self.why, "text": self.hint,
        }  # fmt: skip

    @property
    def why(self) -> str:
        """Why it is not certain; "" where it is."""
        if self.is_certain:
            return ""
        return (
            f"it takes {share_text(1.0 - self.after.chi2 / self.before.chi2)} of the chi2 of these stretches, and less "
            f"than {share_text(1.0 - MAX_REMAINING)} may be the wrong shape of something else"
        )

    @property
    def _found(self) -> list[Coefficient]:
        """The time constants that were looked for: one that stands for a term in dT/dt was not."""
        fixed = self.response.structure.fixed
        return [entry for name, entry in self.shapes.items() if name.removesuffix("_s") not in fixed]

    @property
    def _lag(self) -> str:
        """The lag in words, with its time constants and structure."""
        u_values = [2 * entry["u"] for entry in self._found if entry["u"] is not None]
        values = [entry["value"] for entry in self._found]
        low, high = (f"{end(values, default=0.0):.0f}" for end in (min, max))
        span = f" of {low} s" if values and low == high else f" of {low} to {high} s" if values else ""
        sure = f" (U at most {max(u_values):.0f} s, k = 2)" if u_values else ""
        beside = f", and {self.beside.effect} beside it" if self.beside is not None else ""
        return f"a lag{span}{sure}, {self.response.structure.sentence}{beside}"

    @property
    def hint(self) -> str:
        """What the response would give, and why it is not certain."""
        rivals = [f"{name} alone would lower it to {rival.rms_dps:.3g} deg/s" for name, rival in self.rivals.items()
                  if rival.is_below(self.before)]  # fmt: skip
        return (
            f"A hint, and not certain: a thermal response of the bias, {self._lag}, would lower the error of "
            f"stretches left out from {self.before.rms_dps:.3g} to {self.after.rms_dps:.3g} deg/s. Not certain because "
            f"{self.why}{'; ' if rivals else ''}{', '.join(rivals)}. A loop at another speed of the temperature would "
            "tell; `labctl improve SERIAL --add thermal_lag` makes a version with it, to be tested on the next record."
        )

    @property
    def sentence(self) -> str:
        """What is certain, and what is not."""
        certain = (
            f"Thermal response of the bias, as one family: {self._lag}; it lowers the error of stretches left out from "
            f"{self.before.rms_dps:.3g} to {self.after.rms_dps:.3g} deg/s."
        )
        if not self.alike:
            return certain
        longest = max((entry["value"] for entry in self._found), default=0.0)
        tell = f"; a step of the temperature, held for {3 * longest / 60:.0f} min, would tell" if longest else ""
        return f"{certain} Whether it is a lag or {' or '.join(self.alike)}, this recording cannot tell{tell}."


def thermal_family(data: FitData, model: ErrorModel, verdict: Verdict) -> ThermalFamily | None:
    """Return the thermal response beside a model, where the verdict asks for one: at rest, over several legs.

    It is named where it `is_certain`, and else a hint. None where it does not predict, and where another member or what
    is named predicts clearly better.
    """
    is_open = verdict.form == "unexplained" or bool(set(verdict.named) & FAMILY)
    if data.info.motion != "rest" or not is_open or LAG in model.effect_ids:
        return None
    leaders = [group[0] for group in verdict.groups if group[0] in verdict.terms]
    others = [group[0] for group in verdict.groups if not set(group) & FAMILY and group[0] in verdict.terms]
    named = model.with_added(verdict.terms[name] for name in leaders)
    model = model.with_added(verdict.terms[name] for name in others)
    response = thermal_response(data, model, Term(LAG, None, {}, "", True))
    if response is None:
        return None
    rivals = {name: _rival(data, model, name) for name in RIVALS}
    family = _both(data, model, response, rivals[BESIDE]) or _lag_alone(response, rivals)
    if family is None or (leaders and _of(data, named).is_below(family.after)):
        return None
    return replace(family, rivals=rivals)


def _lag_alone(response: ThermalResponse, rivals: Mapping[str, LeftOut]) -> ThermalFamily | None:
    """Return the lag by itself; None where it predicts too little for a hint, or another member clearly better."""
    after = response.held_out[response.structure.id]
    is_hint = after.chi2 <= MAX_REMAINING_OF_HINT * response.held_out[NONE.id].chi2
    return ThermalFamily(response) if is_hint and not any(rival.is_below(after) for rival in rivals.values()) else None


def _both(data: FitData, model: ErrorModel, lag: ThermalResponse, rival: LeftOut) -> ThermalFamily | None:
    """Return a lag and a hysteresis together, where they leave clearly less than the better of them alone.

    They then take most of what that one leaves beyond the noise, and enough chi2 of stretches left out for each
    coefficient more. The shape of the hysteresis is the one that leaves least of all data beside a lag of one time
    constant.
    """
    alone = min(lag.held_out[lag.structure.id], rival, key=lambda left: left.chi2)
    if alone.chi2 < MIN_LEFT_ALONE * alone.n:
        return None
    term = min(_options(BESIDE), key=lambda term: _left_beside(data, model, term))
    response = thermal_response(data, model.with_added((term,)), lag.term)
    if response is None:
        return None
    # what the model leaves without either of them
    response = replace(response, held_out={**response.held_out, NONE.id: lag.held_out[NONE.id]})
    family = ThermalFamily(response, beside=term, alone=alone)
    after, more = family.after, len(data.outputs) + 1  # its size on each axis, and its width
    enough = alone.chi2 - after.chi2 > SEEN * more * max(after.chi2 / after.n, 1.0)
    most = after.chi2 - after.n <= MAX_REMAINING * (alone.chi2 - alone.n)
    return family if enough and most and after.is_below(alone) else None


def _left_beside(data: FitData, model: ErrorModel, term: Term) -> float:
    """Return the chi2 that a term and a lag of one time constant leave of all data."""
    beside, every = model.with_added((term,)), np.ones(len(data), dtype=bool)
    axes = [Axis(data, beside, axis) for axis in data.outputs]
    taus = best_taus(axes, STRUCTURES[0], every)
    left = [axis.left_over_noise(axis.columns(STRUCTURES[0], taus[axis.name]), every) for axis in axes]
    return float(sum(np.sum(each**2) for each in left))


def _options(effect: str) -> list[Term]:
    """Return the shapes in which a member is tried."""
    return CATALOGUE[effect].options(Span(1.0, 0.1, (0.0,), frozenset({"t_s", "temperature_c"})))


def hint_of_added(data: FitData, model: ErrorModel, effects: Collection[str]) -> ThermalFamily | None:
    """Return the thermal response beside a forward model to which a lag is added, where it is no more than a hint."""
    if LAG not in effects:
        return None
    return family_or_hint(data, model, Verdict("unexplained"))[1]


def family_or_hint(
    data: FitData, model: ErrorModel, verdict: Verdict
) -> tuple[ThermalFamily | None, ThermalFamily | None]:
    """Return the thermal response beside a model as one that is named, or as a hint; None for the other, or both."""
    family = thermal_family(data, model, verdict)
    return (family, None) if family is None or family.is_certain else (None, family)


def with_family(verdict: Verdict, family: ThermalFamily | None) -> Verdict:
    """Return the verdict that names the family once in place of its members; other effects stay as they are named."""
    if family is None or not family.is_certain:
        return verdict
    others = tuple(group for group in verdict.groups if not set(group) & FAMILY)
    beside = tuple((term.effect,) for term in family.terms[1:])
    groups = ((LAG, *family.alike), *beside, *others)
    form: Form = "missing" if all(len(group) == 1 for group in groups) else "ambiguous"
    return replace(
        verdict, form=form, groups=groups, terms={**verdict.terms, **{term.effect: term for term in family.terms}},
        depends_on=verdict.depends_on or ("t_s",), confounded=(), remainder=None,
    )  # fmt: skip


def _of(data: FitData, model: ErrorModel) -> LeftOut:
    """Return what a model leaves."""
    return left_out_by([Axis(data, model, axis) for axis in data.outputs], NONE, stretches_of(data))


def _rival(data: FitData, model: ErrorModel, effect: str) -> LeftOut:
    """Return what a single other member leaves, in the shape that fits the rest best in each case."""
    kind, terms = CATALOGUE[effect], _options(effect)
    axes = [Axis(data, model, axis) for axis in data.outputs]
    options = [
        [np.column_stack([c.values for c in kind.columns(data.channels, axis.name, term, model.reference)])
         for term in terms]
        for axis in axes
    ]  # fmt: skip
    rivals: list[tuple[Axis, NDArray[np.bool_], NDArray[np.float64]]] = []
    for in_fit, tested in stretches_of(data):
        residual = np.zeros(len(terms))
        for axis, axis_options in zip(axes, options, strict=True):
            residual += [float(np.sum(axis.left_over_noise(columns, in_fit) ** 2)) for columns in axis_options]
        best = int(np.argmin(residual))
        rivals += [
            (axis, tested, axis.errors(axis_options[best], in_fit, tested))
            for axis, axis_options in zip(axes, options, strict=True)
        ]
    return pooled(rivals)

"""The thermal response of a unit at rest as one family: lag, rate of change and hysteresis are its members.

Each member resembles the others on one course of the temperature. Self-heating and warm-up go by the time since
power-on and stay effects of their own, beside which the response is sought. What is certain is how well the response
predicts stretches that it has not seen, and its time constants; which member it is may not be, and then is not claimed.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.criticism.verdict import Form, Verdict
from labctl.fitting.data.fit_data import FitData
from labctl.fitting.effects import CATALOGUE, Span, Term
from labctl.fitting.estimation.thermal_response import (
    NONE,
    Axis,
    LeftOut,
    ThermalResponse,
    left_out_by,
    pooled,
    stretches_of,
    thermal_response,
)
from labctl.fitting.models.error_model import ErrorModel
from labctl.json_types.criticism import Advice, ThermalFamilyJson
from labctl.json_types.models import Coefficient

LAG = "thermal_lag"
#: The members beside the lag, and all of them.
RIVALS = ("temperature_rate", "thermal_hysteresis")
FAMILY = frozenset({LAG, *RIVALS})
#: A response is there where it leaves less than this share of the chi2 of stretches left out.
MOST_LEFT = 0.25


@dataclass(frozen=True)
class ThermalFamily:
    """A thermal response that predicts what it has not seen."""

    response: ThermalResponse
    alike: tuple[str, ...] = ()  #: members that predict as well, alone
    shapes: dict[str, Coefficient] = field(default_factory=dict)  #: time constants with u, where they were asked for

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
            effect=LAG, add=True, why="", before_dps=self.before.rms_dps, after_dps=self.after.rms_dps
        )  # fmt: skip

    def to_json(self) -> ThermalFamilyJson:
        """Return this as JSON."""
        return {
            "structure": self.response.structure.id, "time_constants": self.shapes, "alike": list(self.alike),
            "before_rms_dps": self.before.rms_dps, "after_rms_dps": self.after.rms_dps,
        }  # fmt: skip

    @property
    def sentence(self) -> str:
        """What is certain, and what is not."""
        values = [entry["value"] for entry in self.shapes.values()]
        known = [2 * entry["u"] for entry in self.shapes.values() if entry["u"] is not None]
        span = f" of {min(values):.0f} to {max(values):.0f} s" if values else ""
        sure = f" (U at most {max(known):.0f} s, k = 2)" if known else ""
        certain = (
            f"Thermal response of the bias, as one family: a lag{span}{sure}, {self.response.structure.sentence}; it "
            f"lowers the error of stretches left out from {self.before.rms_dps:.3g} to {self.after.rms_dps:.3g} deg/s."
        )
        if not self.alike:
            return certain
        longest = max(values, default=0.0)
        tell = f"; a step of the temperature, held for {3 * longest / 60:.0f} min, would tell" if longest else ""
        return f"{certain} Whether it is a lag or {' or '.join(self.alike)}, this recording cannot tell{tell}."


def thermal_family(data: FitData, model: ErrorModel, verdict: Verdict) -> ThermalFamily | None:
    """Return the thermal response beside a model, where the verdict asks for one: at rest, over several legs.

    None where it does not predict, and where another member or what is named predicts clearly better.
    """
    asked = verdict.form == "unexplained" or bool(set(verdict.named) & FAMILY)
    if data.info.motion != "rest" or not asked or LAG in model.effect_ids:
        return None
    leaders = [group[0] for group in verdict.groups if group[0] in verdict.terms]
    others = [group[0] for group in verdict.groups if not set(group) & FAMILY and group[0] in verdict.terms]
    named = model.with_added(verdict.terms[name] for name in leaders)
    model = model.with_added(verdict.terms[name] for name in others)
    response = thermal_response(data, model, Term(LAG, None, {}, "", True))
    if response is None:
        return None
    after = response.held_out[response.structure.id]
    if after.chi2 > MOST_LEFT * response.held_out[NONE.id].chi2:
        return None
    rivals = {name: _rival(data, model, name) for name in RIVALS}
    if any(rival.is_below(after) for rival in rivals.values()):
        return None
    if leaders and _of(data, named).is_below(after):
        return None
    return ThermalFamily(response, tuple(name for name, rival in rivals.items() if not after.is_below(rival)))


def with_family(verdict: Verdict, family: ThermalFamily | None) -> Verdict:
    """Return the verdict that names the family once in place of its members; other effects stay as they are named."""
    if family is None:
        return verdict
    others = tuple(group for group in verdict.groups if not set(group) & FAMILY)
    groups = ((LAG, *family.alike), *others)
    form: Form = "missing" if all(len(group) == 1 for group in groups) else "ambiguous"
    return replace(
        verdict, form=form, groups=groups, terms={**verdict.terms, LAG: family.response.term},
        depends_on=verdict.depends_on or ("t_s",), confounded=(), remainder=None,
    )  # fmt: skip


def _of(data: FitData, model: ErrorModel) -> LeftOut:
    """Return what a model leaves."""
    return left_out_by([Axis(data, model, axis) for axis in data.outputs], NONE, stretches_of(data))


def _rival(data: FitData, model: ErrorModel, effect: str) -> LeftOut:
    """Return what a single other member leaves, in the shape that fits the rest best in each case."""
    kind = CATALOGUE[effect]
    terms = kind.options(Span(1.0, 0.1, (0.0,), frozenset({"t_s", "temperature_c"})))
    axes = [Axis(data, model, axis) for axis in data.outputs]
    options = [
        [np.column_stack([c.values for c in kind.columns(data.channels, axis.name, term, model.reference)])
         for term in terms]
        for axis in axes
    ]  # fmt: skip
    found: list[tuple[Axis, NDArray[np.bool_], NDArray[np.float64]]] = []
    for seen, tested in stretches_of(data):
        left = np.zeros(len(terms))
        for axis, own in zip(axes, options, strict=True):
            left += [float(np.sum(axis.left_over_noise(columns, seen) ** 2)) for columns in own]
        best = int(np.argmin(left))
        found += [(axis, tested, axis.errors(own[best], seen, tested)) for axis, own in zip(axes, options, strict=True)]
    return pooled(found)

"""An error model: an ordered set of effects, and how temperature enters."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal

from labctl.fitting.data.channels import Channels
from labctl.fitting.effects import Column, Reference, Term, kind_of
from labctl.fitting.models.temperature import Constant, TemperatureBasis, basis_from_dict
from labctl.fitting.numeric.arrays import Array
from labctl.json_types.models import ErrorModelJson, TermJson

Argument = Literal["rate", "output"]
#: Effects of these origins belong to the unit and are exported with its calibration.
EXPORTED_ORIGINS = frozenset({"sensor", "package"})


def is_exported(term: Term) -> bool:
    """Return whether an effect belongs to the unit and can be corrected where the unit is used."""
    found = kind_of(term)
    return found.origin in EXPORTED_ORIGINS and found.in_use


@dataclass(frozen=True)
class ErrorModel:
    """A set of effects. `argument` says whether rate regressors see the true rate or the gyro's output."""

    name: str
    terms: tuple[Term, ...]
    argument: Argument = "rate"
    temperature: TemperatureBasis = field(default_factory=Constant)
    reference: Reference = field(default_factory=Reference)

    @property
    def effect_ids(self) -> list[str]:
        """The ids of the effects, in order."""
        return [term.effect for term in self.terms]

    @property
    def needs(self) -> tuple[str, ...]:
        """The channels that its effects need beside rate and temperature; what remembers has its state instead."""
        return tuple(sorted({n for t in self.terms if not kind_of(t).remembers for n in kind_of(t).needs}))

    @property
    def steady(self) -> frozenset[str]:
        """The ids of the effects that have one coefficient for all temperatures."""
        return frozenset(term.effect for term in self.terms if term.steady)

    def columns(self, channels: Channels, axis: str) -> list[tuple[str, Column]]:
        """Return (effect id, regressor) of one output axis, before temperature multiplies the regressors."""
        return [(effect_id, column.averaged(channels)) for effect_id, column in self.carried(channels, axis)]

    def carried(self, channels: Channels, axis: str) -> list[tuple[str, Column]]:
        """Return the same with each column's carrier: the wave in the table angle whose amplitude the column is."""
        return [
            (term.effect, column)
            for term in self.terms
            for column in kind_of(term).columns(channels, axis, term, self.reference)
        ]

    def with_terms(self, terms: tuple[Term, ...], name: str | None = None) -> ErrorModel:
        """Return the same model with other effects."""
        return replace(self, terms=terms, name=name or self.name)

    def to_dict(self) -> ErrorModelJson:
        """Return the model without coefficients, as JSON."""
        return {
            "name": self.name,
            "argument": self.argument,
            "terms": [_term_json(term) for term in self.terms],
            "temperature": self.temperature.to_dict(),
            "reference": {"temperature_c": self.reference.temperature_c},
        }

    @staticmethod
    def from_dict(record: ErrorModelJson) -> ErrorModel:
        """Return the model that `to_dict` described."""
        return ErrorModel(
            record["name"],
            tuple(
                Term(t["effect"], t["order"], dict(t["parameters"]), t.get("formula", ""), t.get("steady", False))
                for t in record["terms"]
            ),
            record["argument"],
            basis_from_dict(record["temperature"]),
            Reference(record["reference"]["temperature_c"]),
        )

    def forward(self) -> ErrorModel:
        """Return the same effects as a law of the true rate: the form that is physics, and that criticism judges."""
        return replace(self, argument="rate")


def _term_json(term: Term) -> TermJson:
    return {
        "effect": term.effect, "order": term.order, "parameters": dict(term.parameters), "formula": term.formula,
        "steady": term.steady,
    }  # fmt: skip


def expand(columns: Array, basis: Array) -> Array:
    """Return each column (n, k) times each temperature function (n, m), (n, k*m), the functions running fastest."""
    return (columns[:, :, None] * basis[:, None, :]).reshape(len(columns), -1)

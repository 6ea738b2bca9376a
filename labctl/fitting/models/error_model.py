"""An error model: an ordered set of effects, and how temperature enters."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from labctl.fitting.data.channels import Argument, Channels
from labctl.fitting.effects import Column, Reference, Term, kind_of
from labctl.fitting.models.held import Held
from labctl.fitting.models.temperature import Constant, TemperatureBasis, basis_from_dict
from labctl.fitting.numeric.arrays import Array
from labctl.recording.columns import RECORDING

if TYPE_CHECKING:
    from labctl.answers.fitted_model import ErrorModelJson, TermJson

#: Effects of these origins belong to the unit and are exported with its calibration.
EXPORTED_ORIGINS = frozenset({"sensor", "package"})


def is_exported(term: Term) -> bool:
    """Return whether an effect belongs to the unit and can be corrected where the unit is used."""
    kind = kind_of(term)
    return kind.origin in EXPORTED_ORIGINS and kind.in_use


@dataclass(frozen=True)
class ErrorModel:
    """A set of effects. `argument` says whether rate regressors see the true rate or the gyro's output."""

    name: str
    terms: tuple[Term, ...]
    argument: Argument = "rate"
    temperature: TemperatureBasis = field(default_factory=Constant)
    reference: Reference = field(default_factory=Reference)
    held: Held = field(default_factory=Held)  #: coefficients that are not fitted

    @property
    def effect_ids(self) -> list[str]:
        """The ids of the effects, in order."""
        return [term.effect for term in self.terms]

    @property
    def needs(self) -> tuple[str, ...]:
        """The channels that its effects need beside rate and temperature; effects that remember have a state."""
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
            for column in _by_recording(term, kind_of(term).columns(channels, axis, term, self.reference), channels)
        ]

    def with_terms(self, terms: tuple[Term, ...], name: str | None = None) -> ErrorModel:
        """Return the same model with other effects."""
        return replace(self, terms=terms, name=name or self.name)

    def with_added(self, terms: Iterable[Term]) -> ErrorModel:
        """Return the same model with more effects, each with one coefficient for all temperatures.

        An effect of which it holds coefficients is replaced: what is added is estimated.
        """
        added = tuple(replace(term, steady=True) for term in terms)
        freed = {term.effect for term in added} & self.held.effects
        kept_terms = tuple(term for term in self.terms if term.effect not in freed)
        return replace(self, terms=(*kept_terms, *added), held=self.held.beside(tuple(freed)))

    def to_dict(self) -> ErrorModelJson:
        """Return the model without coefficients, as JSON."""
        model_json: ErrorModelJson = {
            "name": self.name,
            "argument": self.argument,
            "terms": [_term_json(term) for term in self.terms],
            "temperature": self.temperature.to_dict(),
            "reference": {"temperature_c": self.reference.temperature_c},
        }
        if self.held.axes:
            model_json["held"] = self.held.to_json()
        return model_json

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
            Held.from_json(record.get("held")),
        )

    def forward(self) -> ErrorModel:
        """Return the same effects as a law of the true rate: the form that is physics, and that criticism judges.

        Coefficients of a law of the output mean something else in it, so those that were held are estimated.
        """
        return self if self.argument == "rate" else replace(self, argument="rate", held=Held())


def _by_recording(term: Term, columns: list[Column], channels: Channels) -> list[Column]:
    """Return the columns of an effect, those of bench, fixture and environment with a coefficient for each recording.

    What belongs to the unit is common to all of its recordings; the rest differs from day to day. A run's or a
    mounting's shift has a column for each anyway.
    """
    parts = channels.by_recording(np.ones(len(channels), dtype=bool))
    if len(parts) < 2 or kind_of(term).origin in EXPORTED_ORIGINS:
        return columns
    numbers = np.asarray(channels[RECORDING])
    recording_columns: list[Column] = []
    for column in columns:
        split = [
            replace(column, name=f"{column.name}_of_{int(numbers[rows][0])}", values=np.where(rows, column.values, 0.0))
            for rows in parts
        ]
        split_parts = [part for part in split if np.any(part.values)]
        recording_columns += [column] if column.law is not None or len(split_parts) < 2 else split_parts
    return recording_columns


def _term_json(term: Term) -> TermJson:
    return {
        "effect": term.effect, "order": term.order, "parameters": dict(term.parameters), "formula": term.formula,
        "steady": term.steady,
    }  # fmt: skip


def expand(columns: Array, basis: Array) -> Array:
    """Return each column (n, k) times each temperature function (n, m), (n, k*m), the functions running fastest."""
    return (columns[:, :, None] * basis[:, None, :]).reshape(len(columns), -1)

"""What the other calibrated units of a type say of a unit before it is measured: the prior of a fit and of a design."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

from labctl.answers.fitted_model import TypePriorJson
from labctl.calibration import read_calibration
from labctl.errors import BadInput, NotEnoughData
from labctl.fitting.data.channels import Argument
from labctl.fitting.estimation.prior import CoefficientPrior
from labctl.fitting.fleet.population import population_of
from labctl.fitting.fleet.prior import prior_of
from labctl.fitting.fleet.unit_coefficients import UnitCoefficients, unit_coefficients_of
from labctl.recording.info import measured_at
from labctl.store import FleetFilter, FleetVersion, Store

#: Units of a type without which it gives no prior; and versions that are read at most, those of the newest recordings.
MIN_UNITS, MAX_VERSIONS = 10, 2000


@dataclass(frozen=True)
class TypePrior:
    """The prior of a type, and what it is from."""

    type: str
    model: str  #: error model of the versions that it is from
    argument: Argument  #: what their law is of
    prior: CoefficientPrior
    left_out: int  #: units of the type that could not be compared
    versions_hash: str  #: SHA-256 over the hashes of the versions that it is from, sorted

    def to_json(self, *, is_used: bool, p_value: float) -> TypePriorJson:
        """Return what a version states of it."""
        return {
            "type": self.type, "model": self.model, "units": self.prior.units, "left_out": self.left_out,
            "is_used": is_used, "p_value": p_value, "versions_hash": self.versions_hash,
        }  # fmt: skip


def prior_of_type(
    store: Store, type_: str, model: str | None, effects: Sequence[str], *, without: str = "",
    groups: Mapping[str, str | None] | None = None, on: datetime | None = None,
) -> TypePrior:  # fmt: skip
    """Return the prior of one more unit of a type for a model, from the newest version of each other unit.

    The versions have this model, or without the added effects; versions that were fitted with a prior themselves do
    not count, nor does the unit `without`. Raises BadInput for a type that is not stated, NotFound for one without
    units, NotEnoughData for too few.
    """
    if not type_:
        raise BadInput("the unit has no type; state its model in the bench file or in recording.toml, or fit it alone")
    whole = "+".join([*([model] if model else []), *(each.partition(":")[0] for each in effects)])
    names = dict.fromkeys([whole, model] if model else ["custom"])
    seen = 0
    for name in filter(None, names):
        units, hashes = _units(store, type_, name, without)
        seen = max(seen, len(units))
        if len({each.serial_number for each in units}) < MIN_UNITS:
            continue
        population = population_of(units)
        if len(population.table) >= MIN_UNITS:
            unit = next(each for each in units if each.serial_number in population.table.serial_numbers)
            chosen = sorted(hashes[serial] for serial in population.table.serial_numbers)
            return TypePrior(
                type_, name, "output" if unit.model.endswith("output") else "rate",
                prior_of(population, groups, on), len({each.serial_number for each in population.left_out}),
                hashlib.sha256("\n".join(chosen).encode()).hexdigest(),
            )  # fmt: skip
        seen = max(seen, len(population.table))
    wanted = FleetFilter(type_)
    if not store.fleet.serials(wanted, "", 1):
        raise wanted.no_match()
    raise NotEnoughData(
        f"type {type_!r} has {seen} other units with comparable calibrations by model {whole or 'custom'}, but a prior "
        f"takes at least {MIN_UNITS}; calibrate more units of the type with this model, or leave the prior out"
    )


def _units(store: Store, type_: str, model: str, without: str) -> tuple[list[UnitCoefficients], dict[str, str]]:
    """Return the calibrated units of a type by a model, and the hash of the newest version of each."""
    units, hashes = [], {}
    for each, document_hash in _versions(
        store.fleet_reports.versions(FleetFilter(type_, error_model=model), MAX_VERSIONS)
    ):
        if each.serial_number != without and each.serial_number not in hashes:  # the newest recordings come first
            units.append(each)
            hashes[each.serial_number] = document_hash
    return units, hashes


def _versions(versions: Iterator[FleetVersion]) -> Iterator[tuple[UnitCoefficients, str]]:
    for each in versions:
        calibration = read_calibration(each.document)
        if "type_prior" in calibration.document["provenance"]:
            continue
        groups = {"batch": each.batch, "supplier": each.supplier, "bench": each.bench}
        yield (
            unit_coefficients_of(calibration.fitted, each.serial, groups, measured_at(each.info)), calibration.hash
        )  # fmt: skip

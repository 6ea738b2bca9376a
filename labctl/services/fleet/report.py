"""The report on a type: what its units have in common, which groups and units differ, what their model is missing."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from datetime import datetime
from typing import TYPE_CHECKING

from labctl.answers.fleet import FleetReportRequest, FleetReportResponse, FleetTypeResponse
from labctl.errors import BadInput
from labctl.progress import report_stage
from labctl.services.cache import cached
from labctl.services.fleet.figures import figures_of, filter_of, type_figures
from labctl.store import FleetFilter, FleetVersion, Store

if TYPE_CHECKING:
    from labctl.fitting.fleet.unit_coefficients import UnitCoefficients

#: Versions that a report is computed from, those of the newest recordings first; each takes about a millisecond.
MAX_VERSIONS = 20_000


def fleet_report(store: Store, request: FleetReportRequest, now: datetime) -> FleetReportResponse:
    """Return the report on the units of a type, computed when something of it changed. Raises BadInput, NotFound."""
    type_ = _the_type(store, request, now)
    of_type = request.model_copy(update={"type": type_})
    question = {
        "fleet": of_type.model_dump(mode="json"), "state": store.fleet_reports.state(filter_of(of_type)),
    }  # fmt: skip
    report = cached(FleetReportResponse, question, lambda: _computed(store, of_type, now))
    figures = next(iter(type_figures(store, of_type, now)), None)  # they change with the date alone
    return report if figures is None else report.model_copy(update={"figures": figures})


def _the_type(store: Store, request: FleetReportRequest, now: datetime) -> str:
    """Return the type that is asked for, or the only one that there is. Raises BadInput, NotFound."""
    types = [each.type for each in store.fleet_reports.types(filter_of(request), now)]
    if request.type or len(types) == 1:
        if request.type and request.type not in types:
            others = [each.type for each in store.fleet_reports.types(FleetFilter(), now)]
            if request.type in others:
                raise filter_of(request).no_match()
            raise BadInput(
                f"no unit of type {request.type!r} matches; the units of this database are of "
                f"{_listed(others) or 'no type: import them'}"
            )
        return request.type or types[0]
    if not types:
        raise filter_of(request).no_match()
    raise BadInput(
        f"a report is on the units of one type, and these are of {len(types)} ({_listed(types)}); name one with --type"
    )


def _listed(names: Sequence[str]) -> str:
    return ", ".join(repr(name) for name in names[:10]) + (" ..." if len(names) > 10 else "")


def _computed(store: Store, request: FleetReportRequest, now: datetime) -> FleetReportResponse:
    from labctl.services.fleet.findings import ageing_in, evidence_in, population_in  # noqa: PLC0415  slow to load

    report_stage("reading the versions")
    versions = list(store.fleet_reports.versions(filter_of(request), MAX_VERSIONS))
    units = list(_coefficients(versions))
    report_stage("comparing the units")
    compared = population_in(units)
    ageing, ageing_text = ageing_in(units)
    report_stage("adding the evidence")
    whole = not (request.batch or request.supplier or request.search)
    evidence = evidence_in(store, request.type, request.model, whole=whole)
    more = (
        [f"Only the {MAX_VERSIONS} versions of the newest recordings were read; choose fewer units with --batch."]
        if len(versions) >= MAX_VERSIONS
        else []
    )
    figures = type_figures(store, request, now)
    return FleetReportResponse(
        type=request.type,
        figures=figures[0] if figures else figures_of(request.type),
        compared=compared.units,
        left_out=compared.left_out,
        coefficients=compared.coefficients,
        groups=compared.groups,
        outliers=compared.outliers,
        ageing=ageing,
        evidence_units=evidence.units,
        missing=evidence.missing,
        text=[*compared.text, *evidence.text, *_by_units(figures), *ageing_text, *more],
    )


def _by_units(figures: Sequence[FleetTypeResponse]) -> list[str]:
    """Return what single units name as missing, in a sentence."""
    if not figures or not figures[0].missing:
        return []
    named = [f"{effect} in {units}" for effect, units in list(figures[0].missing.items())[:5]]
    return [f"Single units name as missing: {', '.join(named)} of {figures[0].criticised} units."]


def _coefficients(versions: Sequence[FleetVersion]) -> Iterator[UnitCoefficients]:
    from labctl.calibration import read_calibration  # noqa: PLC0415  slow to load
    from labctl.fitting.fleet.unit_coefficients import unit_coefficients_of  # noqa: PLC0415  as above
    from labctl.recording.info import measured_at  # noqa: PLC0415  as above

    for each in versions:
        groups = {"batch": each.batch, "supplier": each.supplier, "bench": each.bench}
        fitted = read_calibration(each.document).fitted
        yield unit_coefficients_of(fitted, each.serial, groups, measured_at(each.info))

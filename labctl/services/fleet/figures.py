"""Figures of the types of units, and control charts of their coefficients: aggregated in the database."""

from __future__ import annotations

from datetime import datetime

from labctl.answers.fleet import (
    FleetChartCoefficient,
    FleetChartPoint,
    FleetChartRequest,
    FleetChartResponse,
    FleetDue,
    FleetReportRequest,
    FleetTypeResponse,
    FleetUnits,
    RatioClass,
)
from labctl.errors import BadInput
from labctl.store import ChartPoint, FleetFilter, Store, TypeFigures
from labctl.store.repositories.fleet_reports import RATIO_EDGES

FACTORS = ("batch", "bench", "supplier")
#: Spans of time of a chart, each a point for each group.
SPANS = 60


def filter_of(request: FleetUnits) -> FleetFilter:
    """Return which units a request is about."""
    model = request.model if isinstance(request, FleetReportRequest) else ""
    return FleetFilter(request.type, request.batch, request.supplier, request.search, model)


def type_figures(store: Store, request: FleetUnits, now: datetime) -> list[FleetTypeResponse]:
    """Return the figures of every type, by name."""
    return [_answer(each) for each in store.fleet_reports.types(filter_of(request), now)]


def figures_of(type_: str) -> FleetTypeResponse:
    """Return the figures of a type without units."""
    return _answer(TypeFigures(type_))


def _answer(figures: TypeFigures) -> FleetTypeResponse:
    edges = (0.0, *RATIO_EDGES)
    missing: dict[str, int] = {}
    for ids, units in figures.named.items():
        for effect in ids.strip('[]"').replace('"', "").split(", "):
            missing[effect] = missing.get(effect, 0) + units
    due, total = figures.due, sum(figures.due.values())
    return FleetTypeResponse(
        type=figures.type,
        units=figures.units,
        error_over_floor=[
            RatioClass(low=low, high=RATIO_EDGES[i] if i < len(RATIO_EDGES) else None, units=figures.ratios.get(i, 0))
            for i, low in enumerate(edges)
        ],
        fitted=sum(figures.ratios.values()),
        verdicts=figures.verdicts,
        criticised=sum(figures.verdicts.values()),
        missing=dict(sorted(missing.items(), key=lambda item: (-item[1], item[0]))),
        due=FleetDue(
            overdue=due.get("overdue", 0), within_30_days=due.get("30_days", 0), within_90_days=due.get("90_days", 0),
            later=due.get("later", 0), no_date=due.get("no_date", 0), none_in_force=figures.units - total,
        ),
    )  # fmt: skip


def fleet_chart(store: Store, request: FleetChartRequest) -> FleetChartResponse:
    """Return the control chart of a coefficient; without a name of the first one. Raises BadInput."""
    axis, name, factor = request.axis, request.name, request.factor
    if factor not in FACTORS:
        raise BadInput(f"factor {factor!r}: choose one of {', '.join(FACTORS)}")
    wanted = filter_of(request)
    known = [FleetChartCoefficient(axis=a, name=n, unit=unit_symbol, units=units)
             for a, n, unit_symbol, units in store.fleet_reports.coefficients(wanted)]  # fmt: skip
    chosen = next((each for each in known if each.name == name and axis in {"", each.axis}), None)
    if name and chosen is None:
        raise BadInput(
            f"coefficient {name!r} of axis {axis or 'any'!r} is not known of these units; choose one of "
            f"{', '.join(sorted({each.name for each in known})) or 'none: no fleet job has fitted any'}"
        )
    chosen = chosen or next(iter(known), None)
    points: list[ChartPoint] = []
    if chosen is not None:
        points, _ = store.fleet_reports.chart(wanted, chosen.axis, chosen.name, factor, SPANS)
    return FleetChartResponse(
        type=request.type,
        axis=chosen.axis if chosen else "",
        name=chosen.name if chosen else "",
        unit=chosen.unit if chosen else "",
        factor=factor,
        points=[FleetChartPoint.model_validate(vars(each)) for each in points],
        coefficients=known,
    )

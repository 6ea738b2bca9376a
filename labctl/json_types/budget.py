"""Uncertainty budgets and reference standards as JSON."""

from __future__ import annotations

from typing import Literal, NotRequired

from typing_extensions import TypedDict


class StandardJson(TypedDict):
    """A reference standard as it was when the readings were taken."""

    quantity: str
    unit: str | None
    name: str
    value: float | None
    corrected: bool
    u: float | None
    expanded: float | None
    k: float
    half_width: float | None
    distribution: str
    freedom: float | None
    certificate: str
    issued_by: str
    calibrated: str | None
    due: str | None
    traceability: str


class BenchConditionsJson(TypedDict):
    """The standards of a calibration's recordings, and what their sensitivities depend on."""

    used_on: str  #: day of the newest recording
    motion: str
    thermometer: Literal["unit", "chamber", "reference"]
    latitude_deg: float | None
    turn_common_u: float | None
    max_rate_dps: float | None
    stated: list[StandardJson]
    mountings: NotRequired[dict[str, float]]  #: position -> its share in the slopes over the rate
    angles_rad: NotRequired[dict[str, dict[str, float]]]  #: output -> name -> angle of the mountings that was fitted


class BudgetLineJson(TypedDict):
    """One source of uncertainty; null is unknown, never 0."""

    source: str
    name: str
    type: Literal["A", "B"]
    distribution: str
    u: float | None
    unit: str
    sensitivity: float | None
    contribution: float | None
    degrees_of_freedom: float | None
    uncorrected: float
    common_to_all_rates: bool
    stated: bool
    overdue: bool
    due: str | None
    why: str


class BudgetJson(TypedDict):
    """A result with its lines; combined and expanded are in `unit`."""

    result: str
    unit: str
    value: float | None
    lines: list[BudgetLineJson]
    combined: float | None
    effective_degrees_of_freedom: float | None
    k: float | None
    expanded: float | None
    not_stated: list[str]
    overdue: bool


class ExpandedJson(TypedDict):
    """A coefficient with its uncertainty, without the lines of its budget; all but the factor in `unit`."""

    value: float | None
    unit: str
    combined: float | None
    effective_degrees_of_freedom: float | None
    k: float | None
    expanded: float | None


class VectorBoundJson(TypedDict):
    """The largest expanded uncertainty of one output over all rate vectors up to `reach_dps`, and where that is.

    `bound_dps` holds in the frame of the case, `aligned_bound_dps` up to a rotation of the frame: for a unit that is
    aligned in use. Both are null where the uncertainty is unknown somewhere, and `why` says why.
    """

    bound_dps: float | None
    aligned_bound_dps: float | None
    reach_dps: float
    rates_dps: dict[str, float]
    temperature_c: float
    why: str


class CrossRatesJson(TypedDict):
    """What rates about axes without an output add to a corrected rate, per deg/s; null is unknown, and why."""

    about: list[str]
    per_dps: float | None
    why: str


class AxisBoundJson(TypedDict):
    """The largest expanded uncertainty of one axis over the calibrated range, the others at rest, and its budget there.

    `bound_dps` is null where the uncertainty is unknown somewhere in the range, and `why` says why. `vector` is that of
    rates about any axis; `cross_rates` is null where every body axis has an output.
    """

    bound_dps: float | None
    rate_dps: float
    temperature_c: float
    why: str
    budget: BudgetJson
    coefficients: dict[str, ExpandedJson]
    vector: NotRequired[VectorBoundJson]
    cross_rates: NotRequired[CrossRatesJson | None]


class UncertaintyJson(TypedDict):
    """The uncertainty of a calibration version, as its document states it."""

    coverage: float
    coefficients_at_c: float
    not_stated: list[str]
    overdue: bool
    axes: dict[str, AxisBoundJson]


class ContributionLinesJson(TypedDict):
    """Contributions along one variable, deg/s; null: not stated or unknown."""

    at: list[float]
    contributions: dict[str, list[float | None]]
    combined: list[float | None]
    expanded: list[float | None]


class ContributionsOverJson(TypedDict):
    """Contributions to the uncertainty of one axis, over rate and over temperature."""

    temperature_c: float
    rate_dps: float
    over_rate: ContributionLinesJson
    over_temperature: ContributionLinesJson

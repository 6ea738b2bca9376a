"""Uncertainty budgets and reference standards as JSON."""

from __future__ import annotations

from typing import Literal, NotRequired

from typing_extensions import TypedDict


class StandardJson(TypedDict):
    """A reference standard as it was when the readings were taken, with one of `u`, `expanded` and `half_width`."""

    quantity: str
    """What it realises: clock, table_rate, thermometer, fixture_angle, ..."""
    unit: str | None
    """Unit of value and uncertainty; null: the usual one of the quantity."""
    name: str
    """Name of the instrument or artefact."""
    value: float | None
    """Known error of the bench, indicated minus true, in `unit`; null: none is known."""
    corrected: bool
    """Whether the bench corrects that error; else its full size is added to U (GUM F.2.4.5)."""
    u: float | None
    """Standard uncertainty, in `unit`, at least 0; null: stated otherwise."""
    expanded: float | None
    """Expanded uncertainty of the certificate, in `unit`, at least 0; null: stated otherwise."""
    k: float
    """Coverage factor of `expanded`, above 0."""
    half_width: float | None
    """Half width of limits, in `unit`, at least 0; null: stated otherwise."""
    distribution: str
    """Distribution within the limits: rectangular, triangular or u-shaped; normal: no limits."""
    freedom: float | None
    """Degrees of freedom, above 0; null: infinite."""
    certificate: str
    """Number of the certificate."""
    issued_by: str
    """Laboratory that issued the certificate."""
    calibrated: str | None
    """Date of its calibration, ISO 8601; null: not stated."""
    due: str | None
    """Last day on which it may be used, ISO 8601; null: no such day."""
    traceability: str
    """What its value is traceable to."""


class BenchConditionsJson(TypedDict):
    """The standards of a calibration's recordings, and what their sensitivities depend on."""

    used_on: str
    """Day of the newest recording, ISO 8601."""
    motion: str
    """Motion of the recordings: rates, rest, turns, profile or poses."""
    thermometer: Literal["unit", "chamber", "reference"]
    """Thermometer that gave the temperatures."""
    latitude_deg: float | None
    """Geodetic latitude of the bench, deg; null: unknown."""
    turn_common_u: float | None
    """Standard uncertainty that all turns by hand have in common, relative to the angle, 1; null: not stated."""
    max_rate_dps: float | None
    """Largest rate of the unit's range, deg/s; null: not stated."""
    stated: list[StandardJson]
    """The standards that the bench states."""
    mountings: NotRequired[dict[str, float]]
    """Position -> its share in the slopes over the rate; absent: not stored."""
    angles_rad: NotRequired[dict[str, dict[str, float]]]
    """Output axis -> name -> angle of the mountings that was fitted, rad; absent: none was."""


class BudgetLineJson(TypedDict):
    """One source of uncertainty; null is unknown, never 0."""

    source: str
    """coefficients, model, repeatability, or the quantity of a reference standard."""
    name: str
    """Name of the standard with its certificate, or of the data evaluated."""
    type: Literal["A", "B"]
    """Evaluated by statistics (A) or otherwise (B), GUM 2.3.2 and 2.3.3."""
    distribution: str
    """Distribution that is assumed of the input: normal, rectangular, triangular or u-shaped."""
    u: float | None
    """Standard uncertainty of the input, in `unit`; null: not stated or unknown."""
    unit: str
    """Unit of `u`."""
    sensitivity: float | None
    """Derivative of the result along the input, per `unit`; null: unknown."""
    contribution: float | None
    """Magnitude of sensitivity times u, in the unit of the result; null: unknown."""
    degrees_of_freedom: float | None
    """Degrees of freedom of `u`; null: infinite."""
    uncorrected: float
    """Known error that is not corrected, in the unit of the result."""
    common_to_all_rates: bool
    """Whether the error is the same at all rates, so that it adds linearly and no mean reduces it."""
    stated: bool
    """Whether the bench states this standard; if not, it is not in the result."""
    overdue: bool
    """Whether the standard was past its due date when it was used."""
    due: str | None
    """Day until which the standard may be used, ISO 8601; null: no due date, or no standard."""
    why: str
    """Why a number is null or 0, or how it was evaluated."""


class BudgetJson(TypedDict):
    """A result with its lines (GUM)."""

    result: str
    """Quantity of the budget: corrected_rate, bias, scale_factor, misalignment with an axis, delay or time_constant."""
    unit: str
    """Unit of the result and of every contribution; 1: a ratio to the rate."""
    value: float | None
    """Value of a coefficient, in `unit`; null: the budget is that of a corrected rate."""
    lines: list[BudgetLineJson]
    """The sources of uncertainty."""
    combined: float | None
    """Combined standard uncertainty, in `unit`; null: a line of type A is unknown."""
    effective_degrees_of_freedom: float | None
    """By Welch-Satterthwaite; null: infinite, or unknown."""
    k: float | None
    """Coverage factor for a probability of 95.45 %; null: unknown."""
    expanded: float | None
    """Expanded uncertainty, k times `combined`, widened for known errors that are not corrected, in `unit`; null:
    unknown."""
    not_stated: list[str]
    """Sources that nothing states and that are not in the result."""
    overdue: bool
    """Whether a standard was past its due date when it was used."""


class ExpandedJson(TypedDict):
    """A coefficient with its uncertainty, without the lines of its budget."""

    value: float | None
    """Value, in `unit`; null: unknown."""
    unit: str
    """Unit of the numbers; 1: a ratio."""
    combined: float | None
    """Combined standard uncertainty, in `unit`; null: unknown."""
    effective_degrees_of_freedom: float | None
    """By Welch-Satterthwaite; null: infinite, or unknown."""
    k: float | None
    """Coverage factor for a probability of 95.45 %; null: unknown."""
    expanded: float | None
    """Expanded uncertainty, in `unit`; null: unknown."""


class VectorBoundJson(TypedDict):
    """The largest expanded uncertainty of one output over all rate vectors up to `reach_dps`, and where that is."""

    bound_dps: float | None
    """Expanded uncertainty in the frame of the case, deg/s; null: unknown somewhere."""
    aligned_bound_dps: float | None
    """The same up to a rotation of the frame, for a unit that is aligned in use, deg/s; null: unknown somewhere."""
    reach_dps: float
    """Largest magnitude of the rate vectors, deg/s."""
    rates_dps: dict[str, float]
    """Body axis -> rate where `bound_dps` is largest, or is unknown, deg/s."""
    temperature_c: float
    """Temperature there, deg C."""
    why: str
    """Why it is unknown; empty where it is known."""


class CrossRatesJson(TypedDict):
    """What rates about axes without an output add to a corrected rate."""

    about: list[str]
    """Body axes without an output."""
    per_dps: float | None
    """Error per deg/s about these axes, in the worst direction, with the coverage of U, 1; null: see `why`."""
    why: str
    """Why it is unknown; empty where it is known."""


class AxisBoundJson(TypedDict):
    """The largest expanded uncertainty of one axis over the calibrated range, the others at rest."""

    bound_dps: float | None
    """Expanded uncertainty, deg/s; null: unknown somewhere in the range."""
    rate_dps: float
    """Rate where it is largest, or is unknown, deg/s."""
    temperature_c: float
    """Temperature where it is largest, or is unknown, deg C."""
    why: str
    """Why it is unknown; empty where it is known."""
    budget: BudgetJson
    """Budget of the corrected rate there."""
    coefficients: dict[str, ExpandedJson]
    """Name -> coefficient with its uncertainty, at `coefficients_at_c`."""
    vector: NotRequired[VectorBoundJson]
    """The bound over rates about any axis; absent: an older version of labctl made the file."""
    cross_rates: NotRequired[CrossRatesJson | None]
    """What rates about axes without an output add; null: every body axis has an output."""


class UncertaintyJson(TypedDict):
    """The uncertainty of a calibration version, as its document states it."""

    coverage: float
    """Probability that the expanded uncertainties cover, 0 to 1."""
    coefficients_at_c: float
    """Temperature of the budgets of the coefficients, deg C."""
    not_stated: list[str]
    """Sources that nothing states and that are not in the results."""
    overdue: bool
    """Whether a standard was past its due date when it was used."""
    axes: dict[str, AxisBoundJson]
    """Output axis -> largest uncertainty over the calibrated range."""


class ContributionLinesJson(TypedDict):
    """Contributions along one variable."""

    at: list[float]
    """Points of the variable: rate, deg/s, or temperature, deg C."""
    contributions: dict[str, list[float | None]]
    """Source -> contribution at each point, deg/s; null: not stated or unknown."""
    combined: list[float | None]
    """Combined standard uncertainty at each point, deg/s; null: unknown."""
    expanded: list[float | None]
    """Expanded uncertainty at each point, deg/s; null: unknown."""


class ContributionsOverJson(TypedDict):
    """Contributions to the uncertainty of one axis."""

    temperature_c: float
    """Temperature of `over_rate`, deg C."""
    rate_dps: float
    """Rate of `over_temperature`, deg/s."""
    over_rate: ContributionLinesJson
    """Contributions over the rate."""
    over_temperature: ContributionLinesJson
    """Contributions over the temperature."""

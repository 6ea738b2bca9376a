"""Error models, their coefficients, and what a fit says beside them."""

from __future__ import annotations

from typing import Annotated, Literal, NotRequired

from typing_extensions import Doc, TypedDict

from labctl.answers.effect_origin import Origin
from labctl.answers.joint import JointJson
from labctl.answers.json_object import JsonObject
from labctl.answers.poses import PosesJson


class TermJson(TypedDict):
    """One effect of a model."""

    effect: str
    """Id of the effect."""
    order: int | None
    """Polynomial order; null: the default order of the effect, or it has none."""
    parameters: dict[str, float]
    """Name -> nonlinear parameter, in the unit that the catalogue states for it."""
    formula: NotRequired[str]
    """Expression of an effect that a user wrote; empty: an effect of the catalogue."""
    steady: NotRequired[bool]
    """Whether it has one coefficient for all temperatures, also in a model with a temperature table."""


class TemperatureBasisJson(TypedDict):
    """How temperature enters a model."""

    kind: Literal["constant", "lagrange"]
    """constant: not at all; lagrange: a table with Lagrange interpolation between its nodes."""
    points: NotRequired[int]
    """Nodes of one interpolation, at least 2; only where `kind` is lagrange."""
    nodes_c: NotRequired[list[float]]
    """Temperatures of the nodes, rising, deg C; only where `kind` is lagrange."""


class ReferenceJson(TypedDict):
    """What the terms of a model are centred on."""

    temperature_c: float
    """Temperature at which the terms in temperature are 0, deg C."""


class HeldCoefficientJson(TypedDict):
    """A coefficient that was not fitted."""

    effect: str
    """Id of the effect that it belongs to."""
    value: float | list[float]
    """Value in `unit`; of a table a list over `temperature_c`."""
    u: float | list[float | None] | None
    """Standard uncertainty in `unit`, at least 0; of a table a list; null: not stated."""
    unit: str
    """Unit of value and uncertainty; 1: a ratio."""
    temperature_c: NotRequired[list[float]]
    """Temperatures of a table, rising, deg C; absent: one value for all temperatures."""


class HeldJson(TypedDict):
    """The coefficients that a fit held at known values."""

    source: str
    """Where the values are from."""
    axes: dict[str, dict[str, HeldCoefficientJson]]
    """Output axis -> name -> coefficient."""


class ErrorModelJson(TypedDict):
    """A model without coefficients."""

    name: str
    """Name of the model."""
    argument: Literal["rate", "output"]
    """rate: a function of the true rate; output: a function of the output."""
    terms: list[TermJson]
    """Effects of the model, in order."""
    temperature: TemperatureBasisJson
    """How the coefficients depend on temperature."""
    reference: ReferenceJson
    """Zero point of the terms in temperature."""
    held: NotRequired[HeldJson]
    """Coefficients held at known values; absent: none."""


class ErrorPartJson(TypedDict):
    """A source of error in a covariance."""

    source: str
    """Name of the source."""
    u: float
    """Standard uncertainty of one error, RMS over all errors of the source, in `unit`."""
    unit: str
    """Unit of `u`."""
    root: list[list[float]]
    """Matrix (k*m, j): change of each coefficient by one standard uncertainty of each of its j errors."""


class AxisFitJson(TypedDict):
    """The coefficients of one output axis: k names by m temperature functions."""

    effects: list[str]
    """Id of the effect of each coefficient, (k)."""
    names: list[str]
    """Name of each coefficient, (k)."""
    units: list[str]
    """Unit of each coefficient, (k); 1: a ratio."""
    values: list[list[float]]
    """Estimates, (k, m), each row in the unit of its coefficient."""
    covariance: list[list[float | None]]
    """Covariance of the estimates, (k*m, k*m), the temperature functions running fastest; null: unknown."""
    parts: NotRequired[list[ErrorPartJson]]
    """Parts of the covariance by errors of the reference, which are included in it; absent: none."""


class FittedModelJson(ErrorModelJson):
    """A model with its coefficients."""

    axes: dict[str, AxisFitJson]
    """Output axis -> coefficients."""


class FittedModelDescription(ErrorModelJson):
    """A model as an answer describes it, with its effects by name."""

    effects: list[str]
    """Ids of the effects, in order."""


class Coefficient(TypedDict):
    """One coefficient with its standard uncertainty."""

    value: float
    """Estimate, in `unit`."""
    u: float | None
    """Standard uncertainty, in `unit`; null: too few data sets, or a derived value that is only a bound."""
    identified: NotRequired[bool]
    """Whether the data determine a derived value (a root or a bandwidth); absent: it is not derived."""
    at_most: NotRequired[float | None]
    """95 % upper bound of a root that is not identified, in `unit`; null: identified, or no bound is known."""
    unit: str
    """Unit of the numbers; 1: a ratio."""


class CoefficientTable(TypedDict):
    """One coefficient at each node of a temperature table; lists over the nodes."""

    value: list[float]
    """Estimates, in `unit`."""
    u: list[float | None]
    """Standard uncertainties, in `unit`; null: too few data sets, or only a bound."""
    identified: NotRequired[list[bool]]
    """Whether the data determine each derived value (a root or a bandwidth); absent: not derived."""
    at_most: NotRequired[list[float | None]]
    """95 % upper bounds of roots that are not identified, in `unit`; null: identified, or no bound is known."""
    unit: str
    """Unit of the numbers; 1: a ratio."""


Entry = Coefficient | CoefficientTable | list[float]
#: Name -> coefficient; of a temperature table, `temperature_c` lists its nodes and every coefficient has one at each.
Coefficients = dict[str, Entry]


class SpecificForceJson(TypedDict):
    """Sensitivity to specific force, for a consumer that has an accelerometer."""

    input: str
    """Name of the input: the specific force in g along the body axes, +1 g at rest along an axis that points up."""
    coefficients: dict[str, dict[str, Coefficient]]
    """Output axis -> name -> coefficient: g_own along the axis itself, g_x ... along another body axis, g_own_squared
    of its square."""
    at_1_g_dps: dict[str, float]
    """Output axis -> upper bound of the error by 1 g in any direction, deg/s."""
    not_measured: dict[str, list[str]]
    """Output axis -> body axes along which its fit saw no force; only axes that have such."""


class AxisCoefficients(TypedDict):
    """The coefficients of one output axis."""

    coefficients: Coefficients
    """Name -> coefficient; of a temperature table, temperature_c lists its nodes in deg C."""


class LegErrorJson(TypedDict):
    """Error of the data sets of one direction of the temperature by a fit to those of the other."""

    fitted: str
    """What the fit used: heating, cooling, or all legs but one."""
    tested: str
    """What was predicted: cooling, heating, or each leg in turn."""
    rms_dps: float | None
    """RMS prediction error, deg/s; null: see `why`."""
    datasets: int
    """Number of data sets that were predicted."""
    why: str
    """Why `rms_dps` is null; else empty."""


class ErrorFiguresJson(TypedDict):
    """Input-referred errors of a fit."""

    raw_rms_dps: float | None
    """Error before any correction, RMS over data sets and axes, deg/s; null: unknown."""
    rms_dps: float | None
    """Error after correction of the data that were fitted, RMS over data sets and axes, deg/s; null: unknown."""
    heldout_rms_dps: float | None
    """Error on data left out of the fit, RMS over data sets and axes, deg/s; null: none can be left out."""
    noise_floor_dps: float | None
    """Standard deviation of a data set mean by noise and drift alone, RMS, deg/s; null: unknown."""
    noise_floor_source: str
    """What the noise floor was computed from; none: it is unknown."""
    heldout_by_leg: NotRequired[list[LegErrorJson]]
    """Errors of heating and cooling by fits to the other; empty: the temperature went one way only."""


class ValidityJson(TypedDict):
    """Range in which a calibration was measured."""

    temperature_c: list[float | None]
    """Lowest and highest temperature, deg C; null: no limit."""
    rate_dps: list[float | None]
    """Lowest and highest true rate over all axes, deg/s; null: no limit."""


class CorrelationTimes(TypedDict):
    """How long a drift between data sets keeps its value."""

    drift_tau_s: float | None
    """Correlation time of the drift, the longest where it has several, s; null: there is no drift, or it is unknown, as
    of a drift by the data sheet."""
    drift_shortest_tau_s: NotRequired[float | None]
    """Shortest correlation time of flicker, of which each decade has an equal part, s; absent or null: only one."""


class AxisNoiseJson(CorrelationTimes):
    """The noise that weighted one axis of a fit."""

    white_dps: float | None
    """Standard deviation of a data set mean by white noise, RMS, deg/s; null: only the total is known."""
    drift_dps: float
    """Standard deviation of the drift between data sets, deg/s; 0: none was found."""
    per_rate: float
    """Standard deviation of the part that grows with the rate, per deg/s of table rate, 1."""
    covariance_scale: float | None
    """Factor on the covariance by the residuals; 1: the white noise is known; null: nothing shows the noise."""


class FitEnvironment(TypedDict):
    """Which thermometer a fit used, and how the Earth's rate was treated."""

    temperature: NotRequired[str]
    """Which thermometer the temperatures are from; absent: that of the unit."""
    earth_rate: NotRequired[str]
    """How the Earth's rate was treated, in words."""
    latitude_deg: NotRequired[float]
    """Geodetic latitude of the bench, deg; absent: unknown."""
    along_table_axis_dps: NotRequired[float]
    """Earth's rate along the axis of the table, deg/s; absent: the latitude is unknown."""
    once_per_turn_dps: NotRequired[dict[str, list[float]]]
    """Output axis -> amplitudes of the waves once per turn that were fitted, deg/s; absent: none were."""
    once_per_turn_expected_dps: NotRequired[float]
    """Amplitude expected from the horizontal part of the Earth's rate, deg/s; absent: none was fitted."""


class TypePriorJson(TypedDict):
    """What other calibrated units of the type contributed to a fit."""

    type: str
    """Type of the units: the model that their manufacturer gives them."""
    model: str
    """Error model of their calibrations."""
    units: int
    """Number of units that the prior is from."""
    left_out: int
    """Units of the type that could not be compared."""
    is_used: bool
    """Whether the prior is in the coefficients; false: the unit contradicts its type and was fitted alone."""
    p_value: float
    """Probability of a larger difference between the unit and its type by chance."""
    versions_hash: str
    """SHA-256 over the sorted hashes of the calibrations that the prior is from."""


class FitResultJson(TypedDict):
    """What a fit reports of its model."""

    model: FittedModelDescription
    """The model that was fitted."""
    axes: dict[str, AxisCoefficients]
    """Output axis -> coefficients."""
    error: ErrorFiguresJson
    """Errors of the fit."""
    validity: ValidityJson
    """Range in which the data were measured."""
    noise: dict[str, AxisNoiseJson]
    """Output axis -> noise that weighted the fit."""
    environment: FitEnvironment
    """Thermometer, and treatment of the Earth's rate."""
    reference_temperature_c: float
    """Temperature at which the terms in temperature are 0, deg C."""
    shapes: NotRequired[dict[str, dict[str, Coefficient]]]
    """Effect -> name -> time constant, s, or width, K; absent: the model has no memory of the temperature."""
    poses: NotRequired[PosesJson]
    """Rests, accelerometer and moves of a calibration in poses; absent: another motion."""
    joint: NotRequired[JointJson]
    """What several recordings report together; absent: a single recording."""


class StateJson(TypedDict):
    """What a correction keeps from sample to sample."""

    equation: str
    """Equations by which the state follows the temperature."""
    elements: list[JsonObject]
    """Elements of the state; the sizes of each are in the order of the axes."""


class LeftOutEffect(TypedDict):
    """An effect of a fit that no correction by output and temperature contains."""

    effect: str
    """Id of the effect."""
    origin: Origin
    """What the effect belongs to."""
    term: str
    """Standard term of the effect (IEEE Std 528)."""
    rms_dps: NotRequired[float | None]
    """RMS of what it adds to the data sets of the fit, deg/s; null or absent: unknown."""


#: The range that an effect's first coefficient usually lies in.
UsualRange = TypedDict(
    "UsualRange",
    {
        "from": Annotated[float, Doc("Least usual value, in the unit of the coefficient.")],
        "to": Annotated[float, Doc("Largest usual value, in the unit of the coefficient.")],
        "inside": Annotated[
            bool,
            Doc(
                "Whether it may be within the range on every axis, given U = 2 u; where both signs occur, by its size."
            ),
        ],
    },
)


class ThermalFamilyJson(TypedDict):
    """A thermal response that predicts stretches of the temperature course which it was not fitted to."""

    structure: str
    """Structure of the response: one, per_axis, curved, two_flows, ..."""
    time_constants: dict[str, Coefficient]
    """Name -> time constant, s: tau_s of all axes, tau_x_s of axis x; empty: not computed."""
    alike: list[str]
    """Ids of the other effects that alone predict as well."""
    before_rms_dps: float
    """RMS error of the stretches left out without the response, deg/s."""
    after_rms_dps: float
    """RMS error of the stretches left out with the response, deg/s."""
    beside: NotRequired[list[str]]
    """Ids of the effects that are there beside the lag, such as thermal_hysteresis; absent: an older version."""


class ThermalHintJson(ThermalFamilyJson):
    """A thermal response that predicts too little to be named."""

    rivals_rms_dps: dict[str, float]
    """Effect -> RMS error of the stretches left out with that effect alone, deg/s."""
    why: str
    """Why it is not certain."""
    text: str
    """The hint in a sentence."""

"""Error models, their coefficients, and what a fit says beside them."""

from __future__ import annotations

from typing import Literal, NotRequired

from typing_extensions import TypedDict

from labctl.json_types import JsonObject
from labctl.json_types.findings import FindingJson
from labctl.json_types.joint import JointJson
from labctl.json_types.poses import PosesJson

Origin = Literal["sensor", "package", "fixture", "bench", "environment"]


class TermJson(TypedDict):
    """One effect of a model: its order and nonlinear parameters, and its expression where a user wrote it."""

    effect: str
    order: int | None
    parameters: dict[str, float]
    formula: NotRequired[str]
    steady: NotRequired[bool]


class TemperatureBasisJson(TypedDict):
    """How temperature enters a model: not at all, or as a table with Lagrange interpolation between its nodes."""

    kind: Literal["constant", "lagrange"]
    points: NotRequired[int]
    nodes_c: NotRequired[list[float]]


class ReferenceJson(TypedDict):
    """What the terms of a model are centred on."""

    temperature_c: float


class HeldCoefficientJson(TypedDict):
    """A coefficient that was not fitted, with its standard uncertainty `u`; null: not stated.

    Of a table, `value` and `u` are lists over `temperature_c`.
    """

    effect: str
    value: float | list[float]
    u: float | list[float | None] | None
    unit: str
    temperature_c: NotRequired[list[float]]


class HeldJson(TypedDict):
    """The coefficients that a fit held at known values, axis -> name -> coefficient, and where they are from."""

    source: str
    axes: dict[str, dict[str, HeldCoefficientJson]]


class ErrorModelJson(TypedDict):
    """A model without coefficients; `held` only where some were held at known values."""

    name: str
    argument: Literal["rate", "output"]
    terms: list[TermJson]
    temperature: TemperatureBasisJson
    reference: ReferenceJson
    held: NotRequired[HeldJson]


class ErrorPartJson(TypedDict):
    """A source of error in a covariance: `root` (k*m, j) is the change of the coefficients by each of its j errors."""

    source: str
    u: float
    unit: str
    root: list[list[float]]


class AxisFitJson(TypedDict):
    """The coefficients of one output axis: k names by m temperature functions, covariance (k*m, k*m)."""

    effects: list[str]
    names: list[str]
    units: list[str]
    values: list[list[float]]
    covariance: list[list[float | None]]
    parts: NotRequired[list[ErrorPartJson]]  #: of the covariance, by errors of the reference; they are in it


class FittedModelJson(ErrorModelJson):
    """A model with its coefficients."""

    axes: dict[str, AxisFitJson]


class FittedModelDescription(ErrorModelJson):
    """A model as an answer tells it, with its effects by name."""

    effects: list[str]


class Coefficient(TypedDict):
    """One number with its standard uncertainty `u`; null where there were no more data sets than coefficients.

    A root of an estimated square is `identified` or not; where it is not, `at_most` is its 95 % bound.
    """

    value: float
    u: float | None
    identified: NotRequired[bool]
    at_most: NotRequired[float | None]
    unit: str


class CoefficientTable(TypedDict):
    """The same at each node of a temperature table."""

    value: list[float]
    u: list[float | None]
    identified: NotRequired[list[bool]]
    at_most: NotRequired[list[float | None]]
    unit: str


Entry = Coefficient | CoefficientTable | list[float]
#: Name -> coefficient; of a temperature table, `temperature_c` lists its nodes and every coefficient has one at each.
Coefficients = dict[str, Entry]


class SpecificForceJson(TypedDict):
    """Sensitivity to specific force, for a consumer that has an accelerometer.

    Output axis -> name -> coefficient: `g_own`, `g_x` ... of the force in g along the axis itself and along another
    body axis, `g_own_squared` of its square. At rest the force is +1 g along an axis that points up. `at_1_g_dps`: the
    largest error of each axis by 1 g in any direction. `not_measured`: axis -> body axes that no force was along.
    """

    input: str
    coefficients: dict[str, dict[str, Coefficient]]
    at_1_g_dps: dict[str, float]
    not_measured: dict[str, list[str]]


class AxisCoefficients(TypedDict):
    """The coefficients of one output axis, by name."""

    coefficients: Coefficients


class LegErrorJson(TypedDict):
    """Error of the data sets of one direction of the temperature by a fit to those of the other, deg/s."""

    fitted: str
    tested: str
    rms_dps: float | None
    datasets: int
    why: str


class ErrorFiguresJson(TypedDict):
    """Input-referred RMS errors, deg/s."""

    raw_rms_dps: float | None
    rms_dps: float | None
    heldout_rms_dps: float | None
    noise_floor_dps: float | None
    noise_floor_source: str
    heldout_by_leg: NotRequired[list[LegErrorJson]]


class ValidityJson(TypedDict):
    """Lowest and highest temperature, deg C, and true rate, deg/s; null: no limit."""

    temperature_c: list[float | None]
    rate_dps: list[float | None]


class AxisNoiseJson(TypedDict):
    """The noise that weighted one axis of a fit."""

    white_dps: float | None
    drift_dps: float
    drift_tau_s: float | None
    per_rate: float
    covariance_scale: float | None


class FitEnvironment(TypedDict):
    """Which thermometer a fit went by, and how the Earth's rate was treated."""

    temperature: NotRequired[str]
    earth_rate: NotRequired[str]
    latitude_deg: NotRequired[float]
    along_table_axis_dps: NotRequired[float]
    once_per_turn_dps: NotRequired[dict[str, list[float]]]
    once_per_turn_expected_dps: NotRequired[float]


class FitResultJson(TypedDict):
    """What a fit says of its model."""

    model: FittedModelDescription
    axes: dict[str, AxisCoefficients]
    error: ErrorFiguresJson
    validity: ValidityJson
    noise: dict[str, AxisNoiseJson]
    environment: FitEnvironment
    reference_temperature_c: float
    shapes: NotRequired[dict[str, dict[str, Coefficient]]]  #: effect -> time constants and widths
    poses: NotRequired[PosesJson]
    joint: NotRequired[JointJson]


class StateJson(TypedDict):
    """Elements that follow the temperature, and the equation that each moves by; sizes are in the order of the axes."""

    equation: str
    elements: list[JsonObject]


class LeftOut(TypedDict):
    """An effect of a fit that no correction by output and temperature contains.

    It does not belong to the unit, or its input is known on the bench only; `specific_force` of a file has those for
    which a consumer needs an accelerometer.
    """

    effect: str
    origin: Origin
    term: str
    rms_dps: NotRequired[float | None]  #: what it does to the data sets of the fit


#: The range that an effect's first coefficient usually lies in, and whether it may do so on every axis.
UsualRange = TypedDict("UsualRange", {"from": float, "to": float, "inside": bool})


class ThermalFamilyJson(TypedDict):
    """A thermal response that predicts stretches of the temperature course that it has not seen.

    `time_constants` by name (`tau_x_s` of axis x, `tau_s` of all), `alike`: other effects that predict as well alone;
    errors of the stretches left out without and with it, deg/s.
    """

    structure: str
    time_constants: dict[str, Coefficient]
    alike: list[str]
    before_rms_dps: float
    after_rms_dps: float


class ThermalHintJson(ThermalFamilyJson):
    """A thermal response that predicts too little to be named, and `why`; what other effects leave alone, deg/s.

    `text` says it in a sentence.
    """

    rivals_rms_dps: dict[str, float]
    why: str
    text: str


class ChangeFigures(FitResultJson):
    """What is said of a change of effects, whether it is kept or not."""

    recording: int
    recordings: list[int]
    improved_from: int
    before: ErrorFiguresJson
    plausible: dict[str, UsualRange]
    warnings: list[FindingJson]
    thermal_hint: ThermalHintJson | None


class KeptFit(FitResultJson):
    """What a fit answered, as it is kept with the version that it made."""

    serial: str
    version: int
    recording: int
    recordings: list[int]
    campaign: int | None
    recipe: str | None
    bench: str | None
    hash: str
    warnings: list[FindingJson]


class KeptChange(ChangeFigures):
    """What a change of effects answered, as it is kept with the version that it made."""

    serial: str
    version: int
    parent: int
    left_out: list[LeftOut]
    hash: str


#: Of a version that labctl 0.1 kept, keys may be missing that came later.
KeptAnswer = KeptFit | KeptChange

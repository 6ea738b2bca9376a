"""Fields that many requests and responses have in common: one declaration, with one description, of each quantity."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Literal

from pydantic import AfterValidator, Field
from pydantic.config import JsonDict
from pydantic_core import PydanticCustomError

from labctl.texts import is_blank

#: Most characters of the name of a person in a request; a name that was stored before may be longer.
MAX_PERSON_CHARACTERS = 120

# descriptions of quantities whose types differ
MOTION = (
    "How the unit was moved: at constant table rates, at rest, turned by known angles, along a rate profile, or by "
    "hand between poses."
)
POSITION = "Position of the unit: the body axis that points up, such as z or -x."
KIND = "Kind of data: samples (every reading), points (one mean per data set) or coefficients (a published table)."
TECHNOLOGY = "Technology of the gyro: fog (fibre-optic), mems or piezo; null: not known."
ROOM_UNIT = "Unit of the quantity: deg C for temperature, % for relative humidity, hPa for air pressure."

#: What a criticism says of a model; `verdict` of its answer says what each means.
CriticismVerdict = Literal["adequate", "missing", "ambiguous", "unexplained", "insufficient_data"]

# who and what
Serial = Annotated[str, Field(description="Serial number of the unit.")]
UnitModel = Annotated[str, Field(description="Model of the unit, as its manufacturer names it; empty: not stated.")]
VersionNumber = Annotated[int, Field(description="Number of the calibration version, counted from 1 for each unit.")]
VersionTime = Annotated[datetime, Field(description="Time at which the version was stored.")]
InForce = Annotated[bool, Field(description="Whether this version is in force: certified last, and not revoked.")]
ParentVersion = Annotated[
    int | None,
    Field(description="Version of which a change of effects made this version; null: it is from a fit."),
]
RecordingNumber = Annotated[int, Field(description="Number of the recording.")]
CampaignNumber = Annotated[int, Field(description="Number of the campaign.")]
BenchName = Annotated[str, Field(description="Name of the bench.")]
RecipeName = Annotated[str, Field(description="Name of the recipe.")]
ModelName = Annotated[str, Field(description="Name of the error model.")]
EffectIds = Annotated[list[str], Field(description="Ids of the effects in the model, as the catalogue names them.")]
CoefficientName = Annotated[str, Field(description="Name of the coefficient.")]
CoefficientUnit = Annotated[str, Field(description="Unit of the coefficient.")]
OutputAxis = Annotated[str, Field(description="Output axis of the unit: x, y or z.")]
CalibrationHash = Annotated[str, Field(description="SHA-256 of the calibration as it was stored.")]
ScheduleHash = Annotated[
    str, Field(description="SHA-256 of the steps in their order; it is equal for two plans of the same steps.")
]
StandardLabel = Annotated[str, Field(description="Name of the reference standard in the register.")]
CertificateNumber = Annotated[str, Field(description="Number of the certificate.")]
LabctlVersion = Annotated[str, Field(description="Version of labctl that the service runs.")]
FileName = Annotated[str, Field(description="Path of the file.")]
FileSize = Annotated[int, Field(description="Size of the file in bytes.")]
FileHash = Annotated[str, Field(description="SHA-256 of the file's content, as `sha256sum` prints it.")]
FormatTitle = Annotated[str, Field(description="Title of the format for a person, such as in a list.")]
DriverName = Annotated[str, Field(description="Name of the driver of the instrument.")]
Distribution = Annotated[str, Field(description="Python distribution (installed package) that provides the driver.")]
DistributionVersion = Annotated[str, Field(description="Version of that distribution.")]


def _short_name(name: str) -> str:
    if len(name := name.strip(" ")) > MAX_PERSON_CHARACTERS:
        words = "the name of a person has {length} characters, at most {limit} are allowed; shorten it"
        raise PydanticCustomError("long_name", words, {"length": len(name), "limit": MAX_PERSON_CHARACTERS})
    return name


def _stated_name(name: str) -> str:
    if is_blank(name):
        words = "the name of a person is blank ({length} characters); give a name of 1 to {limit} characters"
        raise PydanticCustomError("blank_name", words, {"length": len(name), "limit": MAX_PERSON_CHARACTERS})
    return _short_name(name)


def _stated_reason(reason: str) -> str:
    if is_blank(reason):
        raise PydanticCustomError("blank_reason", "the reason is blank; state in words why")
    return reason


def _cut_name(name: str) -> str:
    return name.strip(" ")[:MAX_PERSON_CHARACTERS]


# an act of a person: in a request, and as it was stored
_LIMIT: JsonDict = {"maxLength": MAX_PERSON_CHARACTERS}
_NAME = "Name of the person who acts; spaces around it are removed."
PersonName = Annotated[
    str, AfterValidator(_stated_name), Field(description=_NAME, json_schema_extra={"minLength": 1, **_LIMIT})
]
#: Of an act that a person may leave unnamed.
OptionalPersonName = Annotated[str, AfterValidator(_short_name), Field(description=_NAME, json_schema_extra=_LIMIT)]
#: Of an act that is not refused for the length of a name, such as an abort: only its beginning is kept.
CutPersonName = Annotated[
    str,
    AfterValidator(_cut_name),
    Field(description=f"{_NAME} Empty: not stated. Only the first {MAX_PERSON_CHARACTERS} characters are kept."),
]
Person = Annotated[str, Field(description="Name of the person who acted, as typed.")]
Reason = Annotated[str, Field(description="Reason for the act, as typed.")]
#: Of an act that needs a reason; an abort is not refused for its reason.
StatedReason = Annotated[str, AfterValidator(_stated_reason), Field(description="Reason for the act, as typed.")]
ActTime = Annotated[datetime, Field(description="Time of the act.")]

# options of a campaign and of a plan
Clip = Annotated[
    bool, Field(description="Whether to leave out points that are beyond the limits of the bench or of a unit.")
]
EndsInDraft = Annotated[bool, Field(description="Whether the campaign ends in a draft if its recipe has [fit].")]

# counts, times and sentences
DatasetCount = Annotated[int, Field(description="Number of data sets.")]
ReadingCount = Annotated[int, Field(description="Number of readings.")]
StepCount = Annotated[int, Field(description="Number of steps of the plan.")]
ExpectedDuration = Annotated[float, Field(description="Expected duration of the campaign, s.")]
Sentences = Annotated[list[str], Field(description="The result in sentences.")]

# errors of a version on a recording
RmsError = Annotated[float, Field(description="Root mean square of the error (corrected minus true rate), deg/s.")]
MaxError = Annotated[float, Field(description="Largest magnitude of the error (corrected minus true rate), deg/s.")]
MeanError = Annotated[float, Field(description="Mean of the error (corrected minus true rate), deg/s.")]

# errors that a fit states: root mean square over data sets and axes
RawRms = Annotated[float | None, Field(description="RMS error before any compensation, deg/s; null: not known.")]
FittedRms = Annotated[
    float | None,
    Field(description="RMS error after compensation, on the data that were fitted, deg/s; null: not known."),
]
HeldoutRms = Annotated[
    float | None,
    Field(description="RMS error on data that were left out of the fit, deg/s; null: not known."),
]
NoiseFloor = Annotated[
    float | None,
    Field(description="RMS error of data-set means due to noise and drift alone, deg/s; null: not known."),
]

# columns, one value for each row
DatasetNumbers = Annotated[list[int], Field(description="Number of the data set in its recording.")]
TableRates = Annotated[list[float], Field(description="Rate of the table, deg/s.")]

"""Work on many units at once: jobs, what came of each unit, and the report on a type."""

from __future__ import annotations

import re
from datetime import datetime
from typing import Annotated, Literal

from pydantic import AfterValidator, Field
from pydantic_core import PydanticCustomError

from labctl.answers.base import Request, ResponseModel
from labctl.answers.common_fields import CriticismVerdict, CutPersonName, Serial
from labctl.answers.storage_url import StorageUrl

#: What a job does with each unit.
FleetKind = Literal["fit", "criticise"]
#: Where a job is.
FleetJobState = Literal["waiting", "running", "done", "cancelled", "failed"]
#: What came of a unit of a job.
FleetUnitState = Literal["waiting", "done", "failed", "skipped"]

_TYPE = "Only units of this type: their model, as their manufacturer names it; empty: of any."
_BATCH = "Only units of this batch; empty: of any."
_SUPPLIER = "Only units of this supplier; empty: of any."
_SEARCH = "Only units whose serial number, type, technology, batch or supplier holds this text, in any case."
_RMS = "RMS residual of the model on the data set means, deg/s; null: not known."
_FLOOR = "RMS residual that noise alone leaves, deg/s; null: not known."


#: What computes, as a pattern.
ENGINE = r"^(local|dask|dask://[A-Za-z0-9_.\-\[\]:]+)$"


def _known_engine(engine: str) -> str:
    if not re.match(ENGINE, engine):
        raise PydanticCustomError("engine", "choose local, dask or dask://HOST:PORT, as dask://lab-3:8786")
    return engine


class FleetUnits(Request):
    """Which units a job or a report is about."""

    type: str = Field(default="", max_length=200, description=_TYPE)
    batch: str = Field(default="", max_length=100, description=_BATCH)
    supplier: str = Field(default="", max_length=200, description=_SUPPLIER)
    search: str = Field(default="", max_length=200, description=_SEARCH)


class FleetJobRequest(FleetUnits):
    """A fit or a criticism of many units, one task for each unit."""

    kind: FleetKind = Field(
        description="fit: a model is fitted to the newest recording of each unit and kept as its next version, which "
        "is not put in force; criticise: the newest version of each unit is compared with its newest recording."
    )
    model: str = Field(
        default="",
        max_length=200,
        description="Name of the error model. For a fit: that is fitted. For a criticism: only units whose newest "
        "version is of this model; empty: of any.",
    )
    effects: list[str] = Field(
        default_factory=list,
        max_length=50,
        description="For a fit: ids of the effects of the model, or with `model` of effects to add to it; `name:2` "
        "sets the polynomial order to 2.",
    )
    accept_warnings: bool = Field(
        default=False, description="Whether to fit data in which labctl found errors, and to keep fits worse than none."
    )
    again: bool = Field(
        default=False,
        description="Whether to compute units again whose newest result has the same recordings, model and program.",
    )
    engine: Annotated[str, AfterValidator(_known_engine)] = Field(
        default="local",
        max_length=300,
        json_schema_extra={"pattern": ENGINE},
        description="What computes: local (processes of this computer), dask (a cluster of Dask on this computer) or "
        "dask://HOST:PORT (the scheduler of a cluster).",
    )
    source: StorageUrl = Field(
        default="",
        description="URL of a storage with published recordings that the readings are read from, such as "
        "s3://bucket/lab, without credentials; empty: from the database.",
    )


class FleetPublishRequest(FleetUnits):
    """Which units' recordings are written to a storage, and where."""

    url: StorageUrl = Field(description="URL of the storage, such as s3://bucket/lab, without credentials.")
    again: bool = Field(default=False, description="Whether to write also recordings that are there unchanged.")


class FleetUnpublished(ResponseModel):
    """A unit whose recordings could not be published."""

    serial: Serial
    reason: str = Field(description="Why, and what to do.")


class FleetPublishResponse(ResponseModel):
    """What was written to a storage."""

    url: str = Field(description="URL of the storage.")
    units: int = Field(description="Number of units that match.")
    written: int = Field(description="Recordings that were written.")
    unchanged: int = Field(description="Recordings that were there already, with the same readings.")
    size_bytes: int = Field(description="Size of the files that were written, byte.")
    failed: list[FleetUnpublished] = Field(description="Units whose recordings could not be published, with reasons.")


class FleetCancelRequest(Request):
    """The end of a job before it is done."""

    cleans_texts = True
    by: CutPersonName = Field(default="", description="Name of the person who cancels it; empty: not stated.")
    reason: str = Field(default="", max_length=2000, description="Reason for it; empty: not stated.")


class FleetJobResponse(ResponseModel):
    """A job: how far it is, what it has cost, and how long it will still take."""

    id: int = Field(description="Number of the job.")
    kind: FleetKind = Field(description="fit or criticise.")
    request: FleetJobRequest = Field(description="What was requested.")
    engine: str = Field(description="What computes: local, dask or the address of a scheduler.")
    by: str = Field(description="Who requested it.")
    created_at: datetime = Field(description="Time at which it was requested.")
    started_at: datetime | None = Field(description="Time at which it was begun; null: not yet.")
    ended_at: datetime | None = Field(description="Time of its end; null: it has not ended.")
    state: FleetJobState = Field(
        description="waiting: not begun; running; done: every unit has a result or a reason; cancelled; failed: it "
        "could not go on, see `why`. What was written before a cancel or a failure stays, and the same request goes on "
        "there."
    )
    ended: bool = Field(description="Whether it has ended.")
    why: str = Field(description="Why it was cancelled or failed; empty otherwise.")
    units: int = Field(description="Number of its units.")
    waiting: int = Field(description="Units that have no result yet.")
    done: int = Field(description="Units whose result was computed and written.")
    failed: int = Field(description="Units that could not be computed; the list of units says why.")
    skipped: int = Field(description="Units whose newest result already has the same recordings, model and program.")
    processor_s: float = Field(description="Processor time of all its units, s.")
    processor_s_per_unit: float | None = Field(
        description="Processor time divided by the number of units that were computed, s; null: none was."
    )
    left_s: float | None = Field(
        description="Expected time to its end by the units finished since its begin, s; null: not known, or ended."
    )


class FleetUnitResponse(ResponseModel):
    """What came of one unit of a job."""

    serial: Serial
    state: FleetUnitState = Field(
        description="waiting: not computed; done: a result was written; failed, skipped: see `reason`."
    )
    version: int | None = Field(description="Version that was made or judged; null: none.")
    reason: str = Field(description="Why it failed or was skipped; empty otherwise.")
    at: datetime | None = Field(description="Time of the result; null: none yet.")
    processor_s: float | None = Field(description="Processor time of the unit, s; null: it was not computed.")
    rms_dps: float | None = Field(description=_RMS)
    noise_floor_dps: float | None = Field(description=_FLOOR)
    verdict: CriticismVerdict | None = Field(description="Verdict of the criticism; null: there was none.")
    named: list[str] | None = Field(description="Ids of the effects that the verdict is based on; null: no verdict.")


class FleetReportRequest(FleetUnits):
    """Which units a report is about."""

    model: str = Field(
        default="", max_length=200, description="Only units whose newest version is of this error model; empty: of any."
    )


class FleetChartRequest(FleetUnits):
    """Which coefficient a control chart is of, and of which units."""

    axis: str = Field(default="", max_length=10, description="Output axis; empty: the first.")
    name: str = Field(default="", max_length=100, description="Name of the coefficient; empty: the first.")
    factor: str = Field(
        default="batch", max_length=10, description="What points are grouped by: batch, bench, supplier."
    )


class RatioClass(ResponseModel):
    """Units of one class of error over noise floor."""

    low: float = Field(description="Least error over noise floor of the class, 1.")
    high: float | None = Field(description="Error over noise floor that the class ends below, 1; null: no end.")
    units: int = Field(description="Number of units.")


class FleetDue(ResponseModel):
    """Units by the date until which their version in force is valid."""

    overdue: int = Field(description="Units whose date has passed.")
    within_30_days: int = Field(description="Units that are due within 30 days.")
    within_90_days: int = Field(description="Units that are due within 90 days, but not within 30.")
    later: int = Field(description="Units that are due later.")
    no_date: int = Field(description="Units with a version in force that has no date.")
    none_in_force: int = Field(description="Units without a version in force.")


class FleetTypeResponse(ResponseModel):
    """The units of one type in figures: how many, how good, how judged, and when due."""

    type: str = Field(description="Type of the units: their model; empty: not stated.")
    units: int = Field(description="Number of units.")
    error_over_floor: list[RatioClass] = Field(
        description="RMS residual over noise floor of the newest version of each unit that a fleet job has fitted."
    )
    fitted: int = Field(description="Units that a fleet job has fitted and whose noise floor is known.")
    verdicts: dict[str, int] = Field(description="Verdict -> units whose newest criticism by a fleet job gave it.")
    criticised: int = Field(description="Units that a fleet job has criticised.")
    missing: dict[str, int] = Field(
        description="Id of an effect -> units whose newest criticism names it as missing, alone or with others."
    )
    due: FleetDue = Field(description="Units by their due date.")


class FleetCoefficientFigures(ResponseModel):
    """One coefficient over the units of a type."""

    name: str = Field(description="Output axis and name of the coefficient, such as x.scale_factor.")
    unit: str = Field(description="Unit of the figures; empty: not stated.")
    mean: float = Field(description="Mean over the units outside of the groups that differ, in `unit`.")
    expanded_u_mean: float = Field(description="Expanded uncertainty of the mean, 95.45 %, in `unit`.")
    spread: float = Field(description="Standard deviation of the units' true values, in `unit`.")
    spread_low: float = Field(description="Lower end of the 95 % interval of the spread, in `unit`.")
    spread_high: float = Field(description="Upper end of the 95 % interval of the spread, in `unit`.")
    median_u: float = Field(description="Median standard uncertainty of the units' own calibrations, in `unit`.")
    units: int = Field(description="Number of units, without outliers.")


class FleetGroup(ResponseModel):
    """A group of units that differs from the rest of its type."""

    factor: str = Field(description="batch, bench, supplier or date (a trend).")
    level: str = Field(description="Name of the group; empty for a trend.")
    coefficients: list[str] = Field(description="Coefficients that it shifts, all by the same amount.")
    shift: float = Field(description="Shift in `unit`; of a trend, per year.")
    u: float = Field(description="Standard uncertainty of the shift, in `unit`.")
    unit: str = Field(description="Unit of the coefficients; empty: not stated.")
    units: int = Field(description="Number of units in the group; of a trend, with a date.")
    p_value: float = Field(description="Probability that chance gives such a group anywhere in the type, 0 to 1.")
    of_bench: bool = Field(description="Whether it is an error of a bench that all units on it share.")
    text: str = Field(description="The finding in a sentence.")


class FleetOutlier(ResponseModel):
    """A unit that is not like its type in one coefficient."""

    serial: Serial
    coefficient: str = Field(description="Output axis and name of the coefficient.")
    t: float = Field(
        description="Distance from what the other units expect over its standard uncertainty, with sign, 1."
    )
    text: str = Field(description="The finding in a sentence.")


class FleetSize(ResponseModel):
    """A coefficient of a missing effect over the units of a type."""

    axis: str = Field(description="Output axis: x, y or z.")
    name: str = Field(description="Name of the coefficient.")
    unit: str = Field(description="Unit of the figures.")
    mean: float = Field(description="Mean over the units, in `unit`.")
    u_mean: float = Field(description="Standard uncertainty of the mean, in `unit`.")
    spread: float = Field(description="Standard deviation of the units' sizes about the mean, in `unit`.")


class FleetMissing(ResponseModel):
    """An effect that the model of a type is missing, or several that cannot be distinguished."""

    effects: list[str] = Field(description="Ids of the effects, the likeliest first.")
    log_bayes_factor: float = Field(description="Natural logarithm of the evidence against nothing missing, 1.")
    common: bool = Field(description="Whether units share the size; false: its sign differs from unit to unit.")
    sizes: list[FleetSize] = Field(description="Its coefficients over the units.")
    rms_unit_z: float = Field(
        description="Root mean square of what single units show, in standard uncertainties, 1; 1 is noise alone."
    )
    of_bench: str | None = Field(description="The only bench whose units show it: the bench's error; null: none.")
    text: str = Field(description="The finding in a sentence.")


class FleetAgeing(ResponseModel):
    """Change of one coefficient per year over the units of a type that were calibrated more than once."""

    name: str = Field(description="Output axis and name of the coefficient.")
    unit: str = Field(description="Unit of the coefficient; the figures are per year.")
    mean: float = Field(description="Mean change per year, in `unit`.")
    u_mean: float = Field(description="Standard uncertainty of the mean, in `unit`.")
    spread: float = Field(description="Standard deviation of the changes of units, in `unit`.")
    units: int = Field(description="Number of units with a history.")


class FleetReportResponse(ResponseModel):
    """What the units of a type have in common, which differ, and what their model is missing."""

    type: str = Field(description="Type of the units: their model.")
    figures: FleetTypeResponse = Field(description="The units in figures.")
    compared: int = Field(description="Units whose coefficients were compared.")
    left_out: int = Field(description="Units with a version that were not compared: their coefficients are others.")
    coefficients: list[FleetCoefficientFigures] = Field(description="Mean and spread of each coefficient.")
    groups: list[FleetGroup] = Field(description="Groups that differ from the rest of the type, strongest first.")
    outliers: list[FleetOutlier] = Field(description="Units that are not like their type, farthest first.")
    ageing: list[FleetAgeing] = Field(description="Change per year of each coefficient; empty: too few histories.")
    evidence_units: int = Field(description="Units whose criticisms were added up for `missing`.")
    missing: list[FleetMissing] = Field(description="Effects that the model of the type is missing, strongest first.")
    text: list[str] = Field(description="The report in sentences, and what could not be said and why.")


class FleetChartCoefficient(ResponseModel):
    """A coefficient that a chart can show."""

    axis: str = Field(description="Output axis: x, y or z.")
    name: str = Field(description="Name of the coefficient.")
    unit: str = Field(description="Unit of the coefficient.")
    units: int = Field(description="Number of units that have it.")


class FleetChartPoint(ResponseModel):
    """A coefficient over the units of one group that were measured in one span of time."""

    level: str = Field(description="Name of the group; empty: not stated.")
    at: datetime = Field(description="Mean time of the measurements.")
    units: int = Field(description="Number of units.")
    mean: float = Field(description="Mean of the coefficient, in its unit.")
    low: float = Field(description="Least value, in its unit.")
    high: float = Field(description="Largest value, in its unit.")
    mean_u: float | None = Field(description="Mean standard uncertainty of a unit, in its unit; null: not known.")


class FleetChartResponse(ResponseModel):
    """A control chart of a coefficient over time, by group."""

    type: str = Field(description="Type of the units: their model; empty: all.")
    axis: str = Field(description="Output axis: x, y or z; empty: no coefficient is known.")
    name: str = Field(description="Name of the coefficient; empty: no coefficient is known.")
    unit: str = Field(description="Unit of the coefficient.")
    factor: str = Field(description="What the points are grouped by: batch, bench or supplier.")
    points: list[FleetChartPoint] = Field(description="Points, by group and time.")
    coefficients: list[FleetChartCoefficient] = Field(description="Coefficients that the chart can show.")

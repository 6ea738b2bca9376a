"""Work on many units at once: jobs, what came of each unit, and the report on a type."""

from __future__ import annotations

from datetime import datetime
from typing import Literal

from pydantic import Field
from typing_extensions import TypedDict

from labctl.answers.base import Request, ResponseModel
from labctl.answers.common_fields import CriticismVerdict, Serial
from labctl.answers.fitted_model import Coefficient

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


class FleetCandidate(TypedDict):
    """The estimate of an effect that may be missing in the model of one unit."""

    effect: str
    """Id of the effect."""
    log_bayes_factor: float
    """Natural logarithm of the Bayes factor of the model with the effect against the model."""
    p_value: float
    """Probability of such a gain in chi2 by chance, corrected for the number of shapes tried, 0 to 1."""
    alias_group: list[str]
    """Ids of the effects that the recording cannot distinguish from it, itself first."""
    coefficients: dict[str, dict[str, Coefficient]]
    """Output axis -> name -> coefficient of the effect."""


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
    engine: str = Field(
        default="local",
        max_length=300,
        pattern=r"^(local|dask|dask://[A-Za-z0-9_.\-\[\]:]+)$",
        description="What computes: local (processes of this computer), dask (a cluster of Dask on this computer) or "
        "dask://HOST:PORT (the scheduler of a cluster).",
    )


class FleetCancelRequest(Request):
    """The end of a job before it is done."""

    cleans_texts = True
    by: str = Field(default="", max_length=200, description="Name of the person who cancels it; empty: not stated.")
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

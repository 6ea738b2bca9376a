"""What the services answer: the same JSON on the command line and over HTTP. Keys named in the contract are fixed."""

from __future__ import annotations

from datetime import datetime
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field


class ResponseModel(BaseModel):
    """A document that leaves the house; more keys may be added, none renamed."""

    model_config = ConfigDict(extra="allow", frozen=True, ser_json_inf_nan="null")


class ImportResponse(ResponseModel):
    """A recording that is now in the database."""

    serial: str
    recording: int
    datasets: int
    readings: int
    suggested_model: str = Field(default="bias_scale", description="A published model for such a recording.")


class ModelResponse(ResponseModel):
    """Which effects a calibration is made of."""

    name: str
    effects: list[str]
    argument: Literal["rate", "output"] = Field(
        description="Whether the regressors see the true rate (forward law) or the gyro's output (direct law)."
    )


class ErrorFigures(ResponseModel):
    """Input-referred errors in deg/s, one value per data set and axis, root mean square over all."""

    raw_rms_dps: float | None = Field(description="Before any compensation.")
    rms_dps: float | None = Field(description="After compensation, on the data of the fit.")
    heldout_rms_dps: float | None = Field(description="Each temperature predicted by a fit that has not seen it.")
    noise_floor_dps: float | None = Field(description="Root of the mean variance of a data-set mean: white and drift.")


class Validity(ResponseModel):
    """Where the calibration was measured; outside it is extrapolation."""

    temperature_c: tuple[float, float] = Field(description="Lowest and highest of the readings, deg C.")
    rate_dps: tuple[float | None, float | None] = Field(
        description="Lowest and highest true rate, deg/s; null: no limit, nothing of the model depends on the rate."
    )


class FitResponse(ResponseModel):
    """A calibration version, as `labctl fit --json` and `POST .../calibrations` give it."""

    serial: str
    version: int
    model: ModelResponse
    axes: dict[str, Any] = Field(description="axis -> coefficients with value, standard uncertainty u, and unit.")
    error: ErrorFigures
    validity: Validity


class CriticismResponse(ResponseModel):
    """A model held against a recording: the verdict in one of five forms, and what it stands on."""

    serial: str
    version: int
    recording: int
    verdict: Literal["adequate", "missing", "ambiguous", "unexplained", "insufficient_data"]
    text: list[str] = Field(description="The verdict in words, the answer first.")
    error: dict[str, Any]
    noise: dict[str, Any]
    lack_of_fit: dict[str, float | None]
    where: list[dict[str, Any]] = Field(description="Ranges of channels in which the residual is far from 0.")
    suspects: list[dict[str, Any]]
    named: list[str] = Field(description="The effects that the verdict stands on.")
    depends_on: list[str] = Field(description="Channels that the residual hangs on, strongest first.")
    not_testable: list[dict[str, Any]]
    experiments: list[dict[str, Any]]
    views: dict[str, Any] = Field(
        default_factory=dict, description="Where and how the model fails, as numbers for pictures, by view."
    )


class ResidualColumns(ResponseModel):
    """One row per data set and axis, as lists of equal length. A data set far longer than the others is in pieces."""

    dataset: list[int] = Field(default_factory=list)
    axis: list[str] = Field(default_factory=list)
    position: list[str] = Field(default_factory=list)
    run: list[int] = Field(default_factory=list)
    table_rate_dps: list[float] = Field(default_factory=list)
    own_rate_dps: list[float] = Field(
        default_factory=list, description="True rate along the axis itself, the Earth's included where it is known."
    )
    temperature_c: list[float] = Field(default_factory=list)
    t_s: list[float | None] = Field(default_factory=list)
    n: list[int | None] = Field(default_factory=list, description="Readings behind the data set; null: not known.")
    measured_error_dps: list[float] = Field(default_factory=list, description="Output minus own rate.")
    modelled_error_dps: list[float] = Field(default_factory=list)
    residual_dps: list[float] = Field(default_factory=list, description="Measured minus modelled error.")
    floor_dps: list[float | None] = Field(default_factory=list, description="What noise alone leaves of this mean.")
    over_floor: list[float | None] = Field(default_factory=list, description="Residual over floor, as in the map.")


class ResidualsResponse(ResponseModel):
    """What a version leaves of a recording."""

    serial: str
    version: int
    recording: int
    columns: ResidualColumns


class LadderRow(ResponseModel):
    """One version of a unit's calibration, with its errors."""

    version: int
    parent: int | None
    model: str
    effects: list[str]
    raw_rms_dps: float | None
    rms_dps: float | None
    heldout_rms_dps: float | None
    noise_floor_dps: float | None


class LadderResponse(ResponseModel):
    """The error, version by version, oldest first."""

    serial: str
    steps: list[LadderRow]
    noise_floor_dps: float | None


class CalibrationRow(ResponseModel):
    """One line of a unit's list of calibrations."""

    serial: str
    version: int
    parent: int | None
    model: str
    created_at: datetime
    hash: str
    certified: bool
    rms_dps: float | None = None
    heldout_rms_dps: float | None = None


class CertificationResponse(ResponseModel):
    """A certification or its revocation."""

    serial: str
    version: int
    act: Literal["certify", "revoke"]
    by: str
    reason: str
    at: datetime
    due: datetime | None = None


class VersionResponse(FitResponse):
    """A calibration version as it was made, and whether it is in force."""

    parent: int | None = None
    recording: int | None = None
    created_at: datetime
    hash: str
    in_force: bool
    due: datetime | None = Field(default=None, description="Until when it is in force as certified; null: no date.")
    certification: CertificationResponse | None = Field(
        description="The newest act on this version; null: there was none."
    )


class UnitResponse(ResponseModel):
    """Who a unit is and what is known of it."""

    serial: str
    model: str
    technology: str | None
    recordings: list[int]
    calibrations: list[int]
    certified_version: int | None


class Visibility(ResponseModel):
    """Whether a schedule could show an effect, and from which size on."""

    effect: str
    visible: bool
    share: float = Field(description="How much of the effect the model beside it does not absorb, 0 to 1.")
    smallest_size: float | None = Field(default=None, description="Just detectable, in the effect's unit.")
    unit: str = ""
    why: Literal["channel", "schedule"] | None = None
    needs: list[str] = Field(default_factory=list)
    experiment: str = ""


class PlanResponse(ResponseModel):
    """What a campaign would do, before anything moves."""

    recipe: str
    bench: str
    steps: int
    datasets: int
    expected_s: float
    clipped: list[str] = Field(description="Points left out because the bench or the unit cannot do them.")
    schedule_hash: str
    visibility: list[Visibility] | None = Field(default=None, description="What the plan could and could not find.")


class PromptResponse(ResponseModel):
    """A question to a person; an answer names its id."""

    id: str
    kind: str
    text: str
    position: str | None = None


class OutputResponse(ResponseModel):
    """What one channel of a unit put out in the last moment, in the channel's unit."""

    gyro: str = Field(description="The unit's name on the bench.")
    channel: str
    unit: str
    mean: float
    std: float = Field(description="Of single readings.")
    n: int
    t_s: float = Field(description="Time of the last reading since the campaign began.")


class CampaignResponse(ResponseModel):
    """Where a campaign is."""

    id: int
    recipe: str
    bench: str
    state: str
    reason: str = ""
    step: int | None = Field(default=None, description="Number of the step, from 1.")
    steps: int
    step_text: str = ""
    progress: float = Field(ge=0, le=1)
    expected_end: datetime | None = None
    t_s: float | None = Field(default=None, description="Campaign time: seconds since it began, on its own clock.")
    chamber_c: float | None = None
    setpoint_c: float | None = None
    gyro_c: float | None = None
    rate_dps: float | None = None
    outputs: list[OutputResponse] = Field(default_factory=list, description="Of a campaign that runs here, now.")
    last_error: str | None = None
    wish: Literal["pause", "abort"] | None = Field(default=None, description="Asked for, and not yet taken up.")
    prompt: PromptResponse | None = Field(default=None, description="The question that waits for a person.")
    links: dict[str, str] = Field(default_factory=dict, description="Instruments that are degraded or lost.")
    dropped: dict[str, str] = Field(default_factory=dict, description="Units that take no further part: name -> why.")
    abandoned: bool = Field(default=False, description="No process runs it any more, and it has no end.")
    started_at: datetime | None = None
    ended_at: datetime | None = None
    recordings: dict[str, int] = Field(default_factory=dict, description="serial -> recording")


class EventResponse(ResponseModel):
    """Something that happened in a campaign."""

    id: int
    at: datetime
    t_s: float
    kind: str
    level: str
    message: str


class BenchStatus(ResponseModel):
    """A bench, and what its last safe state could not confirm."""

    name: str
    last_used_at: datetime
    unconfirmed: str = Field(default="", description="Until a person has looked and clears it; empty when all is well.")
    unconfirmed_at: datetime | None = None
    left: list[str] = Field(
        default_factory=list, description="Campaigns that no process runs any more and nobody has ended."
    )


class StartEventResponse(ResponseModel):
    """What became of one start that fell due."""

    at: datetime
    due_at: datetime
    outcome: Literal["claimed", "started", "refused", "missed"]
    message: str
    campaign: int | None = None


class ScheduledResponse(ResponseModel):
    """A campaign that is to begin later."""

    id: int
    bench: str
    recipe: str
    state: str = Field(description="waiting, ended or cancelled.")
    due_at: datetime | None = Field(description="When it begins next, in its time zone; null when it is over.")
    time_zone: str
    cron: str | None
    priority: int
    clip: bool
    late_limit_s: float | None
    created_at: datetime
    note: str = ""
    history: list[StartEventResponse] = Field(default_factory=list)


class DeviceCheck(ResponseModel):
    """What one instrument of a bench answered."""

    device: str
    ok: bool
    text: str

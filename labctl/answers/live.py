"""Live calibrations: what the service is asked for, how one stands, and the answer at its end."""

from __future__ import annotations

from datetime import datetime
from typing import Literal

from pydantic import Field

from labctl.answers.base import Request, ResponseModel
from labctl.answers.calibrations import FitResponse
from labctl.answers.common_fields import CoefficientName, CoefficientUnit, OutputAxis, Serial

#: A serial number, as a recording takes it.
SERIAL = r"^[A-Za-z0-9][A-Za-z0-9._+# -]{0,63}$"
#: Idle: none since the service began. The last three are the ends: with or without a version, and without a recording.
LiveStage = Literal["idle", "running", "storing", "done", "ended", "failed"]
LiveEnd = Literal["complete", "stream", "interrupted"]


class LiveRequest(Request):
    """Which unit to calibrate while a person turns it, by which stream, and to which target."""

    serial: str | None = Field(
        default=None,
        pattern=SERIAL,
        description="Serial number of the unit; for the bench's own stream it may be left out: its first gyro.",
    )
    address: str | None = Field(
        default=None,
        max_length=500,
        description="A stream of the network: `tcp://HOST:PORT` sends lines of JSON or CSV, at `udp://HOST:PORT` they "
        "arrive as datagrams, `ws://HOST:PORT` is a rosbridge server. Default: the gyro of this service's bench.",
    )
    topic: str = Field(
        default="/imu/data",
        min_length=1,
        max_length=200,
        description="Topic of a rosbridge server, of type sensor_msgs/Imu (rad/s and m/s^2).",
    )
    latitude_deg: float | None = Field(
        default=None, ge=-90, le=90, description="Latitude, deg; for the bench's own stream that of its file is used."
    )
    target_u: float = Field(
        default=1e-3,
        gt=0,
        le=1,
        description="Limit of the expanded uncertainty U (k = 2) of each scale factor and each misalignment (rad), 1.",
    )
    target_bias_dps: float | None = Field(
        default=None, gt=0, le=1e4, description="Limit of U (k = 2) of each bias, deg/s; null: no limit."
    )
    poses: int = Field(default=18, description="Poses to ask for, 12 to 26: six faces, twelve edges, eight corners.")
    rest_s: float = Field(default=2.0, description="How long the unit is to rest in each pose, s.")
    end_unwatched: bool = Field(
        default=False,
        description="True: the calibration ends, and its recording is kept, once no page has followed it for 30 s. "
        "False: it goes on until its target, the end of its stream or an end that a person asks for.",
    )


class LiveEndRequest(Request):
    """The end of the live calibration that runs."""

    cleans_texts = True

    fit: bool = Field(
        default=False,
        description="Fit a version of what was measured, although the target is not reached. False: the recording "
        "alone is kept.",
    )
    reason: str = Field(default="", max_length=500, description="Why it is ended.")


class LiveCoefficientResponse(ResponseModel):
    """One coefficient of a live calibration."""

    axis: OutputAxis
    name: CoefficientName
    value: float = Field(description="Value of the coefficient, in `unit`.")
    expanded: float = Field(description="Expanded uncertainty U with k = 2, in `unit`.")
    unit: CoefficientUnit
    limit: float | None = Field(description="Limit of U by the target; null: the target states none.")


class LiveFigures(ResponseModel):
    """What the readings of a live calibration determine."""

    readings: int = Field(description="Number of readings so far.")
    lost: int = Field(description="Readings that are missing by the instrument's counter or by the clock.")
    damaged: int = Field(description="Lines or frames of the stream that could not be read.")
    duration_s: float = Field(description="Time from the first to the last reading, s.")
    rests: int = Field(description="Number of rests that were recognised.")
    poses: list[str] = Field(description="Asked poses that rests cover, by the body axes that point up.")
    poses_asked: int = Field(description="Number of poses that the target asks for.")
    coefficients: list[LiveCoefficientResponse] = Field(
        description="By the fit to all readings; empty where they do not allow one."
    )
    missing: list[str] = Field(description="What is missing, in words; empty when the calibration is complete.")
    left_out: list[str] = Field(description="Turns that the fit could not use, and why.")


class LiveResponse(LiveFigures):
    """Result of a live calibration: what was measured, what it determines, and what is missing."""

    serial: Serial
    complete: bool = Field(description="Whether the target was reached.")
    ended: LiveEnd = Field(
        description="Why it ended: the target was reached, the stream ended or failed, or the person ended it."
    )
    text: str = Field(description="Why it ended, in words.")
    recording: int = Field(description="Number of the recording, which holds every reading.")
    fit: FitResponse | None = Field(
        description="The new calibration version; null: none was to be fitted, or the fit was refused."
    )
    refused: str = Field(default="", description="Why no version was kept although one was to be fitted.")


class LivePoseResponse(ResponseModel):
    """A pose of a unit."""

    name: str = Field(description="Body axes that point up, such as `z`, `x,-z` or `x,y,-z`.")
    text: str = Field(description="The pose in words.")
    up: list[float] = Field(description="The direction in the body that points up, of length 1: x, y, z.")
    covered: bool = Field(description="Whether a rest that is long enough covers it.")


class LiveTargetResponse(ResponseModel):
    """When a live calibration is complete."""

    u: float = Field(description="Limit of U (k = 2) of each scale factor and each misalignment (rad), 1.")
    bias_dps: float | None = Field(description="Limit of U (k = 2) of each bias, deg/s; null: none.")
    poses: int = Field(description="Number of poses to ask for, 12 to 26.")
    rest_s: float = Field(description="How long the unit is to rest in a pose, s.")


class LiveMoment(LiveFigures):
    """A live calibration while the unit is turned."""

    still_s: float = Field(description="How long the unit has been at rest now, s; 0 while it is turned.")
    up: list[float] | None = Field(
        description="The direction in the body of the specific force now, of length 1, which points up where the unit "
        "is at rest; null before the first readings."
    )
    request: LivePoseResponse | None = Field(description="The pose that is asked for; null when it is complete.")
    off_deg: float | None = Field(
        description="Angle between the pose the unit is in and the one that is asked for, deg; a rest covers a pose "
        "within 17 deg. Null without either."
    )
    request_text: str = Field(description="What the person is asked for, in words.")
    pose_list: list[LivePoseResponse] = Field(description="The poses that are asked for in all, in their order.")
    turns_left: int | None = Field(
        description="Turns until every U is within its limit, if U falls with the square root of their number; null "
        "before the first fit."
    )
    fits: int = Field(description="Fits so far; each is a point of the history.")
    example: str = Field(description="What is wrong with the first line that could not be read; empty without one.")


class LiveStateResponse(ResponseModel):
    """The live calibration of this service: the one that runs, or the last that ran."""

    stage: LiveStage = Field(
        description="`idle`: none since the service began; `running`; `storing`: the recording is stored and fitted; "
        "`done`: with a version; `ended`: without one, the recording is kept; `failed`: see `text`."
    )
    number: int = Field(description="It counts the calibrations of this service process; 0: none.")
    serial: str = Field(description="Serial number of the unit; empty: none since the service began.")
    stream: str = Field(description="Where the readings come from.")
    bench: str = Field(description="The bench that it has meanwhile; empty for a stream of the network.")
    by: str = Field(description="Who began it.")
    started_at: datetime | None = Field(description="Time at which it began; null: none since the service began.")
    end_unwatched: bool = Field(description="Whether it ends once no page has followed it for 30 s.")
    target: LiveTargetResponse | None = Field(
        description="When the calibration is complete; null: none since the service began."
    )
    moment: LiveMoment | None = Field(description="Null before the first readings.")
    text: str = Field(description="What it is doing, or why it ended, in words.")
    result: LiveResponse | None = Field(description="Once the recording is stored.")
    kept: list[str] = Field(
        description="Folders with readings that are in no database yet, left by a process that ended early: "
        "`labctl import FOLDER` stores them."
    )


class LiveUncertaintyColumn(ResponseModel):
    """U of one coefficient over the fits of a live calibration."""

    axis: OutputAxis
    name: CoefficientName
    unit: CoefficientUnit
    limit: float | None = Field(description="Limit of U by the target; null: the target states none.")
    expanded: list[float | None] = Field(description="U (k = 2) at each fit, in `unit`; null: the fit has none.")


class LiveHistoryResponse(ResponseModel):
    """How U fell, fit by fit: all of them."""

    number: int = Field(description="Which calibration of this service process.")
    t_s: list[float] = Field(description="Time of the last reading of each fit, s since the first.")
    poses: list[int] = Field(description="Poses that were covered.")
    coefficients: list[LiveUncertaintyColumn] = Field(description="U of each coefficient, fit by fit.")

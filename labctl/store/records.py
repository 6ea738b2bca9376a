"""What the store hands out: plain frozen records, no SQL inside."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from functools import cached_property
from typing import TYPE_CHECKING, Literal

from labctl.answers.json_object import JsonDocument, JsonObject
from labctl.answers.judgement import JudgementDetail
from labctl.answers.kept_answers import KeptAnswer
from labctl.answers.raw_channels import RawChannelJson
from labctl.answers.steps import StepJson
from procedures.contracts.campaign_state import CampaignState

if TYPE_CHECKING:
    from instruments.bench_config import BenchFile
    from labctl.recording.info import RecordingInfo


@dataclass(frozen=True)
class Unit:
    """A gyro, by serial number."""

    serial: str
    model: str
    technology: str | None
    first_seen_at: datetime
    batch: str = ""  #: of the manufacturer; empty: not stated
    supplier: str = ""  #: empty: not stated


@dataclass(frozen=True)
class UnitHoldings:
    """Numbers of a unit's recordings, newest first, and of the versions of its calibration, rising."""

    recordings: list[int]
    versions: list[int]


@dataclass(frozen=True)
class NewUnit:
    """A unit that a campaign is about to measure: how it is called on the bench, and what its recording will say."""

    gyro: str
    info: JsonDocument  #: RecordingInfo as JSON
    channels: tuple[RawChannelJson, ...]  #: name, unit, scale, offset of each raw channel


@dataclass(frozen=True)
class RecordingRow:
    """One recording, without its readings."""

    id: int
    serial: str
    campaign: int | None
    gyro: str | None
    kind: str
    info: JsonDocument  #: as it is stored
    created_at: datetime
    datasets: int
    readings: int

    @cached_property
    def recording_info(self) -> RecordingInfo:
        """`info`, validated."""
        from labctl.recording.info import RecordingInfo  # noqa: PLC0415  most rows are listed, and stay as they are

        return RecordingInfo.model_validate(self.info)


@dataclass(frozen=True)
class DataSetRow:
    """One data set, without its readings. Times are seconds of the recording; absent: not known."""

    number: int
    state: str
    reason: str
    position: str
    run: int
    mounting: int
    table_rate_dps: float
    table_angle_deg: float | None
    chamber_setpoint_c: float | None
    t_from_s: float | None
    t_until_s: float | None
    n: int
    lost: int
    damaged: int
    verification: bool  #: measured to verify a calibration, and never fitted


@dataclass(frozen=True)
class MeanRow:
    """A data set's figures of one channel, in the channel's unit."""

    number: int
    channel: str
    mean: float | None
    std: float | None


@dataclass(frozen=True)
class CampaignRow:
    """One campaign: what was planned and where it is."""

    id: int
    recipe_name: str
    recipe: JsonObject
    bench_name: str
    bench: JsonObject
    schedule_hash: str
    expected_s: float
    state: CampaignState
    reason: str
    created_at: datetime
    started_at: datetime | None
    ended_at: datetime | None
    recordings: Mapping[str, int]  #: serial -> recording

    @cached_property
    def bench_file(self) -> BenchFile:
        """`bench`, validated, without its simulation: that may have settings of another version of labctl."""
        from instruments.bench_config import BenchFile  # noqa: PLC0415  as above

        return BenchFile.model_validate({**self.bench, "simulation": None})


@dataclass(frozen=True)
class StepRow:
    """One step of a campaign's plan."""

    number: int
    kind: str
    body: StepJson
    expected_s: float
    state: str
    started_s: float | None
    ended_s: float | None
    result: JsonObject | None


@dataclass(frozen=True)
class DoneStepRow:
    """A step of a campaign that was done, and on what."""

    campaign: int
    bench: JsonObject  #: the bench file of the campaign
    body: StepJson
    took_s: float


@dataclass(frozen=True)
class EventRow:
    """Something that happened in a campaign."""

    id: int
    campaign: int
    at: datetime
    t_s: float
    kind: str
    level: Literal["info", "warning", "error"]
    message: str
    device: str | None
    value: float | None
    limit: float | None
    unit: str | None


@dataclass(frozen=True)
class CalibrationRecord:
    """One calibration version with the bytes that are served."""

    serial: str
    version: int
    parent: int | None
    recording: int | None
    model: str
    created_at: datetime
    hash: str
    document: bytes
    answer: KeptAnswer  #: what `labctl fit --json` said
    recordings: tuple[int, ...] = ()  #: all that it was fitted to, rising; `recording` is the newest of them


@dataclass(frozen=True)
class Judgement:
    """What was known of a version when it was certified."""

    verdict: str | None  #: of its newest criticism on its own recording; None: impossible, `detail` says why
    recording: int | None  #: of that criticism
    at: datetime | None  #: when that criticism was made
    override: bool  #: whether it was certified against objections
    detail: JudgementDetail  #: reason, text, error figures, objections


@dataclass(frozen=True)
class Withdrawal:
    """Who withdrew a certificate, when and why."""

    by: str
    by_key: str | None  #: name of the API key that acted; None: `by` is as typed
    reason: str
    at: datetime
    act: int | None = None  #: number of the newest act on its version then: its revocation, or a certification


@dataclass(frozen=True)
class Release:
    """The second person of a certification."""

    by: str
    by_key: str
    reason: str
    request: int  #: number of the request that was released


@dataclass(frozen=True)
class CertificationRow:
    """One act of certifying or revoking."""

    serial: str
    version: int
    act: str
    by: str
    reason: str
    at: datetime
    due_at: datetime | None
    judgement: Judgement | None = None  #: None of a revocation, and of acts before verdicts were kept
    by_key: str | None = None  #: name of the API key that acted; None: `by` is as typed
    release: Release | None = None  #: None: no second person was needed


@dataclass(frozen=True)
class ServedCalibration:
    """A version's bytes and hash as they were stored, and the newest act on it; None: there was none."""

    document: bytes
    hash: str
    act: CertificationRow | None
    in_force: bool  #: whether that act is the newest of the unit, and puts the version in force
    certificate: str | None = None  #: number of the newest certificate of the version; None: it has none
    withdrawal: Withdrawal | None = None  #: of that certificate
    act_number: int | None = None
    judgement: str | None = None  #: `JudgementDetail` that was kept with the act, as JSON: not every reader needs it


@dataclass(frozen=True)
class AuditRow:
    """One act: who did what to what, when, and what else there is to say."""

    id: int
    at: datetime
    who: str
    action: str
    subject: str
    detail: JsonDocument
    hash: str


@dataclass(frozen=True)
class KeyRow:
    """One API key; in force until it is revoked."""

    name: str
    role: str
    digest: str
    created_at: datetime
    revoked_at: datetime | None

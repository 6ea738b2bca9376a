"""Requests with an address: which unit, version, campaign, bench, key or start a command is for."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from datetime import datetime
from pathlib import Path
from typing import ClassVar, Generic, Self, TypeVar

from labctl.answers.base import Request
from labctl.answers.campaigns import CampaignRequest, ResumeRequest
from labctl.recording.column_map import ColumnMap

BodyT_co = TypeVar("BodyT_co", bound=Request, covariant=True)


@dataclass(frozen=True)
class Addressed:
    """A request whose fields fill in the path of its command; the field `body`, if there is one, is sent as JSON."""

    #: Fields that only a process which runs the campaign itself can follow; over HTTP a value there is refused.
    local_only: ClassVar[tuple[str, ...]] = ()

    def address(self) -> dict[str, object]:
        """Return all fields but the body, by name."""
        return {field.name: getattr(self, field.name) for field in fields(self) if field.name != "body"}

    def to_driver(self, bench: str) -> Self:  # noqa: ARG002  for requests that name a bench
        """Return the request as the service that drives `bench` takes it."""
        return self


@dataclass(frozen=True)
class ToUnit(Addressed, Generic[BodyT_co]):
    """A request for a unit."""

    serial: str
    body: BodyT_co


@dataclass(frozen=True)
class ToVersion(Addressed, Generic[BodyT_co]):
    """A request for a calibration version of a unit."""

    serial: str
    version: int
    body: BodyT_co


@dataclass(frozen=True)
class ToNewestOrVersion(Addressed, Generic[BodyT_co]):
    """A request for a calibration version of a unit; None: the newest."""

    serial: str
    version: int | None
    body: BodyT_co


@dataclass(frozen=True)
class ToCampaign(Addressed, Generic[BodyT_co]):
    """A request for a campaign."""

    campaign: int
    body: BodyT_co


@dataclass(frozen=True)
class ToDiagnosis(Addressed, Generic[BodyT_co]):
    """A request for a diagnosis."""

    diagnosis: int
    body: BodyT_co


@dataclass(frozen=True)
class ToBench(Addressed, Generic[BodyT_co]):
    """A request for a bench."""

    bench: str
    body: BodyT_co

    def to_driver(self, bench: str) -> Self:
        """Return the request with the name of the bench: what a person gives may be a file."""
        return replace(self, bench=bench)


@dataclass(frozen=True)
class ToKey(Addressed, Generic[BodyT_co]):
    """A request for an API key."""

    name: str
    body: BodyT_co


@dataclass(frozen=True)
class ToStandard(Addressed, Generic[BodyT_co]):
    """A request for a reference standard, by its label or serial number."""

    label: str
    body: BodyT_co


@dataclass(frozen=True)
class ToFinding(Addressed, Generic[BodyT_co]):
    """A request for a finding on a reference standard."""

    label: str
    finding: int
    body: BodyT_co


@dataclass(frozen=True)
class ToStart(Addressed):
    """A request for an entry of the schedule."""

    start: int


@dataclass(frozen=True)
class CampaignStart(Addressed):
    """A campaign to start, now or later, with options of the process that would run it in its foreground."""

    local_only: ClassVar[tuple[str, ...]] = ("bench", "speed", "seed", "simulated_start", "wire_log")

    body: CampaignRequest
    bench: str | None = None
    speed: float | None = None
    seed: int | None = None
    simulated_start: datetime | None = None  #: aware
    wire_log: Path | None = None  #: file that gets every byte between labctl and the bench

    def to_driver(self, bench: str) -> Self:  # noqa: ARG002  as above
        """Return the request without its bench, which is the service's own."""
        return replace(self, bench=None)


@dataclass(frozen=True)
class CampaignResume(Addressed):
    """A campaign to resume; in the foreground without a number the newest unfinished one."""

    local_only: ClassVar[tuple[str, ...]] = ("wire_log",)

    campaign: int | None
    body: ResumeRequest
    bench: str | None = None
    speed: float | None = None
    wire_log: Path | None = None  #: file that gets every byte between labctl and the bench

    def to_driver(self, bench: str) -> Self:  # noqa: ARG002  as above
        """Return the request without its bench, which is the service's own."""
        return replace(self, bench=None)


@dataclass(frozen=True)
class LogFile:
    """A log in a format of others, with the map of its columns; None: the one that is proposed."""

    path: Path
    column_map: ColumnMap | None = None
    importer: str | None = None
    options: tuple[str, ...] = ()
    leave_out: tuple[str, ...] = ()  #: kinds of findings whose readings are left out


@dataclass(frozen=True)
class RecordingFolder:
    """A folder that holds a recording in the interchange format."""

    folder: Path
    leave_out: tuple[str, ...] = ()  #: kinds of findings whose readings are left out

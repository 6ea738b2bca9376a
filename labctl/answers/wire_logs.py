"""Replays of wire logs."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, Field

from labctl.answers.base import ResponseModel
from labctl.answers.common_fields import BenchName, Clip, EndsInDraft, FileName
from labctl.answers.json_object import JsonObject

#: What a session does.
SessionKind = Literal["campaign", "bench check", "campaign resume", "live", "driver test"]


class ReadingsDigest(ResponseModel):
    """What a session has measured, as far as it is needed to compare two sessions."""

    sha256: str = Field(description="SHA-256 of every column of every complete data set, with the times.")
    datasets: int = Field(description="Number of complete data sets, counted per unit.")
    readings: int = Field(description="Number of readings in them.")


class RecordedSession(BaseModel):
    """What a session does, in the header of its wire log: enough to do it again."""

    kind: SessionKind = Field(description="What the session does.")
    recipe: str = Field(
        default="", description="Only for a campaign: name of a shipped recipe, or its own text as TOML; else empty."
    )
    clip: Clip = False
    fit: EndsInDraft = False
    campaign: int | None = Field(
        default=None,
        description="Number of the campaign that is resumed, in the database of the session; null: none is.",
    )
    unit: str = Field(default="", description="Serial number of the unit of a live calibration; else empty.")
    description: JsonObject = Field(
        default_factory=dict, description="Description of the instrument that is tried; empty: none is."
    )

    @property
    def can_be_replayed(self) -> bool:
        """Whether a log of it alone is enough to do it again."""
        return self.kind in {"campaign", "bench check"}


class SessionResult(BaseModel):
    """How a session ended, in the last line of its wire log."""

    state: str | None = Field(
        default=None, description="State in which the campaign ended; null: the session ran none."
    )
    readings: ReadingsDigest | None = Field(default=None, description="What the session measured; null: nothing.")
    said: list[str] = Field(default_factory=list, description="Findings of the check of a bench.")
    ended_by: str | None = Field(default=None, description="The error that ended the session; null: none did.")
    left_out: int = Field(default=0, description="Number of events that are not in the log.")


class ReplayResponse(ResponseModel):
    """What a replay of a wire log has come to."""

    file: FileName
    ok: bool = Field(
        description="Whether labctl sent what it sent in the session, and the result is that of the session, as far as "
        "the log tells."
    )
    session: SessionKind = Field(description="What the session did.")
    labctl: str = Field(description="Release of labctl that wrote the log.")
    bench: BenchName
    duration_s: float = Field(description="Time from the begin of the session to the end of the log, s of its clock.")
    requests: int = Field(description="Number of requests that were the same as in the session.")
    whole: bool = Field(description="Whether the log has the end of the session.")
    difference: str = Field(description="Where the replay left the session, as text; empty: nowhere.")
    recorded: ReadingsDigest | None = Field(description="What the session measured; null: the log does not tell.")
    found: ReadingsDigest | None = Field(description="What the replay measured; null: this session stores nothing.")
    remarks: list[str] = Field(description="What else is different, or limits the comparison.")

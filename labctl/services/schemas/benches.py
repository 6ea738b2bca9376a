"""Benches: status, checks and clearing."""

from __future__ import annotations

from datetime import datetime
from typing import Literal

from pydantic import Field, JsonValue

from labctl.services.schemas.base import Request, ResponseModel


class ClearRequest(Request):
    """Who has inspected a bench whose safe state was not confirmed."""

    by: str = Field(min_length=1, max_length=200)
    reason: str = "inspected the bench"


class CheckRequest(Request):
    """A check of the whole bench; it needs no answers."""


class BenchStop(ResponseModel):
    """A stop that is not carried out yet, or that keeps the bench from moving by itself."""

    id: str = Field(description="Identifier of the stop, as in the audit trail.")
    at: str = Field(description="When the stop was asked for, ISO 8601, UTC.")
    by: str = Field(description="Who asked for the stop.")
    reason: str = Field(description="Why the stop was asked for.")
    campaign: int | None = Field(description="The campaign that the stop ends; null: whatever runs on the bench.")
    phase: Literal["asked", "stopping", "stopped"] = Field(
        description="asked: no process has confirmed the stop, the table may turn. stopping: the bench is being made "
        "safe. stopped: the stop is carried out; nothing moves by itself until a person starts or resumes a campaign, "
        "or clears the bench."
    )
    text: str = Field(description="How far the stop is, and what keeps it, in words.")


class BenchStatus(ResponseModel):
    """A bench, and what its last safe state could not confirm."""

    name: str
    last_used_at: datetime
    unconfirmed: str = Field(
        default="",
        description="What the last safe state could not confirm; kept until a person has inspected and "
        "cleared the bench; empty when all is well.",
    )
    unconfirmed_at: datetime | None = None
    attempts: int = Field(
        default=0, description="How many times labctl has tried again to set the safe state since `unconfirmed_at`."
    )
    attempted_at: datetime | None = None
    confirmed_at: datetime | None = Field(
        default=None,
        description="When a later attempt confirmed the safe state; a person must still inspect and clear the bench.",
    )
    left: list[str] = Field(
        default_factory=list, description="Interrupted campaigns: their process ended before they did."
    )
    stop: BenchStop | None = Field(
        default=None, description="The newest stop that is not carried out yet, or not taken back; null: none."
    )


class FindingResponse(ResponseModel):
    """One thing that was found out about an instrument."""

    what: str
    text: str = Field(description="The finding in words; if it is doubtful or bad, what is wrong and what to do.")
    state: Literal["good", "doubtful", "bad"]
    value: float | None = None
    unit: str = ""


class DeviceCheck(ResponseModel):
    """What one instrument of a bench answered."""

    device: str
    ok: bool
    text: str = Field(description="The bad findings or, if there are none, all findings, in one line.")
    kind: Literal["table", "chamber", "reference", "gyro", "other"] = "other"
    state: Literal["good", "doubtful", "bad"] = Field(
        default="good",
        description="doubtful: a campaign can run, but its results may be less accurate. bad: a campaign cannot "
        "run, or its results would be wrong.",
    )
    address: str = Field(default="", description="Port of the instrument, or its host and TCP port.")
    findings: list[FindingResponse] = Field(default_factory=list)
    reported: dict[str, str] = Field(
        default_factory=dict,
        description="Identification reported by the instrument and its USB adapter, such as serial number, firmware "
        "version and name of the adapter.",
    )
    driver: str = Field(default="", description="Name of the driver of the instrument.")
    distribution: str = Field(
        default="", description="Python distribution (installed package) that provides the driver."
    )
    version: str = Field(default="", description="Version of that distribution.")


class BenchCheckResponse(ResponseModel):
    """Whether every instrument of a bench answered."""

    bench: str
    ok: bool
    checked_at: datetime
    devices: list[DeviceCheck]


class BenchUnit(ResponseModel):
    """A unit on a bench."""

    name: str
    serial: str
    driver: str


class StopResponse(ResponseModel):
    """What came of a stop of the whole bench."""

    bench: str = Field(description="Name of the bench.")
    stands: bool = Field(description="Whether it is confirmed that the table stands.")
    text: str = Field(description="How the bench was stopped, in words.")
    campaign: int | None = Field(description="The campaign that the stop has ended; null: none ran.")


class BenchDescription(ResponseModel):
    """A bench and what it is doing."""

    name: str
    simulated: bool
    latitude_deg: float | None
    units: list[BenchUnit]
    campaign: int | None = Field(description="The campaign that runs now; null: none.")
    live: str = Field(default="", description="The unit that is calibrated live on the bench now; empty: none.")
    unconfirmed: str = Field(
        description="What the last safe state of the bench could not confirm; empty when all is well."
    )
    check: BenchCheckResponse | None = Field(
        default=None, description="Result of the latest check since the service started; null: not checked yet."
    )
    heard_s: float = Field(
        default=0.0,
        description="Time since the last answer of the process that drives the bench, s; 0: this "
        "process drives the bench.",
    )
    stop: BenchStop | None = Field(
        default=None, description="The newest stop that is not carried out yet, or not taken back; null: none."
    )
    speed: float | None = Field(
        default=None,
        description="Speed of simulated time that was asked for, times real time; null: no campaign runs, the time is "
        "that of this computer, or it runs as fast as possible.",
    )
    speed_reached: float | None = Field(
        default=None,
        description="Speed of simulated time that was reached in the last 10 s, times real time: a busy computer does "
        "not reach every speed. null: no campaign runs, not known yet, or the time is that of this computer.",
    )


class BenchResponse(BenchDescription):
    """The bench of a service, and what a person is asked before a campaign starts there."""

    start_questions: dict[str, str] = Field(
        description="For each check: the question that a person must confirm "
        "before a start; empty for a simulated bench."
    )


class ShippedBench(ResponseModel):
    """A bench that comes with labctl, and what stands on it."""

    name: str
    text: str


class PortResponse(ResponseModel):
    """A serial port of this computer."""

    device: str = Field(
        description="Device file of the port at present, such as /dev/ttyUSB0; it may change "
        "when adapters are plugged in."
    )
    path: str = Field(
        description="Path of the port for use in a bench file; it does not depend on the order in "
        "which adapters were plugged in."
    )
    adapter: str = Field(description="Serial number of the USB adapter of the port; empty: it has none.")
    product: str
    trouble: str = Field(description="Why the port cannot be used, and what to do; empty: the port can be used.")


class NewBenchRequest(Request):
    """Where to look for instruments, and what a person has said already."""

    name: str = Field(min_length=1, max_length=200)
    latitude_deg: float | None = None
    ports: list[str] = Field(
        default_factory=list, description="Serial ports to search; empty: all serial ports of this computer."
    )
    hosts: list[str] = Field(default_factory=list, description="HOST or HOST:PORT of Modbus TCP instruments.")
    settings: dict[str, JsonValue] = Field(default_factory=dict, description="SECTION.KEY -> value.")


class FoundResponse(ResponseModel):
    """What is at one address."""

    address: str
    kind: str = Field(description="table, chamber or gyro; empty where nothing was recognised.")
    driver: str
    text: str = Field(description="The instrument that was recognised; or why none was recognised, and what to do.")


class NewBenchResponse(ResponseModel):
    """A bench file that was written."""

    file: str
    found: list[FoundResponse]
    bench: dict[str, JsonValue] = Field(description="Content of the bench file, section by section.")


class WiggleUnit(ResponseModel):
    """What moved when one unit was to be turned by hand."""

    unit: str
    serial: str
    port: str
    moved: list[str] = Field(
        description="Units of which the readings showed a rotation by hand, the one with the highest rate first."
    )
    ok: bool = Field(description="Whether the readings of this unit moved, and those of no other unit.")
    text: str


class WiggleResponse(ResponseModel):
    """Whether every unit is on its port."""

    bench: str
    ok: bool
    units: list[WiggleUnit]

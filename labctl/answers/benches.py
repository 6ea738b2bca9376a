"""Benches: status, checks and clearing."""

from __future__ import annotations

from datetime import datetime
from typing import Literal

from pydantic import Field, JsonValue

from labctl.answers.base import Request, ResponseModel
from labctl.answers.common_fields import (
    BenchName,
    Distribution,
    DistributionVersion,
    DriverName,
    FileName,
    PersonName,
    Serial,
)


class ClearRequest(Request):
    """Who has inspected a bench whose safe state was not confirmed."""

    by: PersonName = Field(description="Name of the person who has inspected the bench.")
    reason: str = Field(default="inspected the bench", description="What the person did, for the audit trail.")


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


class BenchDriver(ResponseModel):
    """The process that has reserved a bench, or had and is gone."""

    url: str | None = Field(description="Address of the service that drives the bench; null: a process at a terminal.")
    host: str = Field(description="Name of the computer on which the process runs.")
    pid: int = Field(description="Number of the process on that computer.")
    since: datetime = Field(description="Time since which the process has the bench.")
    last_sign_at: datetime = Field(
        description="Time at which the process last renewed its reservation; it does so every 10 s."
    )
    alive: bool = Field(
        description="Whether the process drives the bench now. false: it has ended without releasing the bench, or has "
        "not renewed its reservation for 120 s."
    )
    text: str = Field(description="The same as a sentence; if the process is gone, what to do.")


class BenchStatus(ResponseModel):
    """A bench, what its last safe state could not confirm, and which process drives it."""

    name: BenchName
    last_used_at: datetime | None = Field(
        description="Time at which a campaign was last begun on the bench; null: none was, but a process has reserved "
        "the bench."
    )
    unconfirmed: str = Field(
        default="",
        description="What the last safe state could not confirm; kept until a person has inspected and "
        "cleared the bench; empty when all is well.",
    )
    unconfirmed_at: datetime | None = Field(
        default=None, description="Time at which the safe state could not be confirmed; null: all is well."
    )
    attempts: int = Field(
        default=0, description="How many times labctl has tried again to set the safe state since `unconfirmed_at`."
    )
    attempted_at: datetime | None = Field(
        default=None, description="Time of the last of these attempts; null: there was none."
    )
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
    driver: BenchDriver | None = Field(
        default=None,
        description="The process that has reserved the bench; null: none has, or the bench is simulated and the "
        "database a file, to which no other process can write.",
    )


class FindingResponse(ResponseModel):
    """One thing that was found out about an instrument."""

    what: str = Field(description="Property that was examined, such as clock, port or air temperature.")
    text: str = Field(description="The finding in words; if it is doubtful or bad, what is wrong and what to do.")
    state: Literal["good", "doubtful", "bad"] = Field(
        description="good: as it should be; doubtful: results may be less accurate; bad: a campaign cannot run, or "
        "its results would be wrong."
    )
    value: float | None = Field(
        default=None, description="Value that was read, in `unit`; null: the finding has no number."
    )
    unit: str = Field(default="", description="Unit of `value`; empty: none.")


class DeviceCheck(ResponseModel):
    """What one instrument of a bench answered."""

    device: str = Field(description="Name of the instrument in the bench file.")
    ok: bool = Field(description="Whether no finding is bad.")
    text: str = Field(description="The bad findings or, if there are none, all findings, in one line.")
    kind: Literal["table", "chamber", "reference", "supply", "gyro", "other"] = Field(
        default="other", description="Kind of instrument."
    )
    state: Literal["good", "doubtful", "bad"] = Field(
        default="good",
        description="doubtful: a campaign can run, but its results may be less accurate. bad: a campaign cannot "
        "run, or its results would be wrong.",
    )
    address: str = Field(default="", description="Port of the instrument, or its host and TCP port.")
    findings: list[FindingResponse] = Field(
        default_factory=list, description="Each thing that was examined on this instrument."
    )
    reported: dict[str, str] = Field(
        default_factory=dict,
        description="Identification reported by the instrument and its USB adapter, such as serial number, firmware "
        "version and name of the adapter.",
    )
    driver: DriverName = ""
    distribution: Distribution = ""
    version: DistributionVersion = ""


class BenchCheckResponse(ResponseModel):
    """Whether every instrument of a bench answered."""

    bench: BenchName
    ok: bool = Field(description="Whether no instrument has a bad finding.")
    checked_at: datetime = Field(description="Time of the check.")
    devices: list[DeviceCheck] = Field(description="The instruments of the bench, each with what was found.")


class BenchUnit(ResponseModel):
    """A unit on a bench."""

    name: str = Field(description="Name of the unit in the bench file.")
    serial: Serial
    driver: DriverName


class StopResponse(ResponseModel):
    """What came of a stop of the whole bench."""

    bench: BenchName
    stands: bool = Field(description="Whether it is confirmed that the table stands.")
    text: str = Field(description="How the bench was stopped, in words.")
    campaign: int | None = Field(description="The campaign that the stop has ended; null: none ran.")


class BenchDescription(ResponseModel):
    """A bench and what it is doing."""

    name: BenchName
    simulated: bool = Field(description="Whether the instruments of the bench are simulated.")
    latitude_deg: float | None = Field(
        description="Latitude of the bench, deg, north positive; null: the bench file does not state it."
    )
    units: list[BenchUnit] = Field(description="Units that the bench file names.")
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

    name: BenchName
    text: str = Field(description="What stands on the bench, in words.")


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
    product: str = Field(description="Name of the product that the USB adapter reports; empty: none.")
    trouble: str = Field(description="Why the port cannot be used, and what to do; empty: the port can be used.")


class NewBenchRequest(Request):
    """Where to look for instruments, and what a person has said already."""

    name: BenchName = Field(min_length=1, max_length=200)
    latitude_deg: float | None = Field(
        default=None, description="Latitude of the bench, deg, north positive; null: not stated."
    )
    ports: list[str] = Field(
        default_factory=list, description="Serial ports to search; empty: all serial ports of this computer."
    )
    hosts: list[str] = Field(default_factory=list, description="HOST or HOST:PORT of Modbus TCP instruments.")
    settings: dict[str, JsonValue] = Field(default_factory=dict, description="SECTION.KEY -> value.")


class FoundResponse(ResponseModel):
    """What is at one address."""

    address: str = Field(description="Port of the instrument, or its host and TCP port.")
    kind: str = Field(description="table, chamber or gyro; empty where nothing was recognised.")
    driver: str = Field(description="Name of the driver for the instrument; empty where nothing was recognised.")
    text: str = Field(description="The instrument that was recognised; or why none was recognised, and what to do.")


class NewBenchResponse(ResponseModel):
    """A bench file that was written."""

    file: FileName
    found: list[FoundResponse] = Field(description="What was recognised at each address that was searched.")
    bench: dict[str, JsonValue] = Field(description="Content of the bench file, section by section.")


class WiggleUnit(ResponseModel):
    """What moved when one unit was to be turned by hand."""

    unit: str = Field(description="Name of the unit in the bench file.")
    serial: Serial
    port: str = Field(description="Port of the unit in the bench file.")
    moved: list[str] = Field(
        description="Units of which the readings showed a rotation by hand, the one with the highest rate first."
    )
    ok: bool = Field(description="Whether the readings of this unit moved, and those of no other unit.")
    text: str = Field(description="The result of this unit as a sentence.")


class WiggleResponse(ResponseModel):
    """Whether every unit is on its port."""

    bench: BenchName
    ok: bool = Field(description="Whether each unit is on its port.")
    units: list[WiggleUnit] = Field(description="The result of each unit.")

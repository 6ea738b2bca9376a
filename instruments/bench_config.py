"""A bench file: the table, chamber and gyros of one bench, their addresses and their limits.

A bench without a table or without a chamber leaves the section out; it runs the recipes that need neither.

Real and simulated instruments differ in `port` and `host` only; `sim://...` leads to the simulators of `[simulation]`.
A `driver` is the name of an installed driver. This module is below the drivers: it knows the keys that every table,
chamber or gyro has, and keeps the others as they are; `instruments.drivers.resolution` checks them by the driver's own
model.
"""

from __future__ import annotations

import math
import tomllib
from importlib import resources
from pathlib import Path
from typing import Annotated, Literal, TypeVar

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, SerializeAsAny, model_validator

from instruments.datasheet import Convention, undeclared
from instruments.eccentricity import Eccentricity
from instruments.laboratory import Laboratory
from instruments.positions import Position
from instruments.standards import Standard
from instruments.toml_documents import MAX_BYTES, read_toml

#: A serial number becomes part of file names, addresses and C comments.
SERIAL = r"^[A-Za-z0-9][A-Za-z0-9._+# -]{0,63}$"
#: Addresses of simulated instruments begin with this scheme.
SIMULATED_SCHEME = "sim://"
#: Addresses of CAN buses begin with this scheme: can://INTERFACE/CHANNEL?bitrate=N, by the names of python-can.
CAN_SCHEME = "can://"


def is_simulated_address(address: str) -> bool:
    """Return whether a port or host of a bench file is a simulated instrument."""
    return address.startswith(SIMULATED_SCHEME)


class Strict(BaseModel):
    """A settings table; an unknown key is an error that names it."""

    model_config = ConfigDict(defer_build=True, extra="forbid", frozen=True)


class DeviceSettings(BaseModel):
    """One instrument of a bench file: its driver and address. A driver's own model adds the keys of the driver."""

    model_config = ConfigDict(defer_build=True, extra="allow", frozen=True)

    driver: str
    port: str | None = None  #: serial devices
    host: str | None = None  #: devices on the network
    tcp_port: int = 502
    adapter: str | None = None  #: serial number of its USB adapter; another one is refused


class TableSettings(DeviceSettings):
    """Address, mechanics and limits of a rate table."""

    driver: str = "arrick-c4"
    steps_per_turn: int = Field(default=1600, gt=0)  #: half steps of the table, after the reduction
    max_rate_dps: float = Field(gt=0)
    acceleration_dps2: float = Field(gt=0)
    places: int | None = Field(default=None, ge=1, le=1000)  #: units that fit on it at once; absent: those in the file


#: Time constant with which the air of a chamber follows a ramp where a bench file states none, s: a guess.
USUAL_AIR_TAU_S = 180.0


class ChamberSettings(DeviceSettings):
    """Address and limits of a chamber controller."""

    min_c: float = -70.0
    max_c: float = 150.0
    safe_c: float = 25.0
    ramp_c_per_min: float = Field(default=1.67, gt=0)
    #: Time constant with which the air follows a ramp, for the expected time of a plan; absent: a guess is used.
    air_tau_s: float | None = Field(default=None, gt=0)

    @model_validator(mode="after")
    def _in_order(self) -> ChamberSettings:
        if not self.min_c < self.max_c:
            raise ValueError(
                f"min_c = {self.min_c:g} deg C must be below max_c = {self.max_c:g} deg C; correct one of the two"
            )
        if not self.min_c <= self.safe_c <= self.max_c:
            raise ValueError(
                f"safe_c = {self.safe_c:g} deg C must lie between min_c = {self.min_c:g} and max_c "
                f"= {self.max_c:g} deg C; correct it"
            )
        return self


class SupplySettings(DeviceSettings):
    """Address of a programmable power supply of the units, and what the units may be supplied with."""

    nominal_v: float = Field(gt=0)
    min_v: float = Field(gt=0)
    max_v: float = Field(gt=0)
    current_limit_a: float = Field(gt=0)
    tolerance_v: float = Field(default=0.05, gt=0)  #: of the measured voltage against the one that was set
    #: "nominal": the units stay on, and a resumed campaign goes on in their powered session; "off": it begins another.
    safe_state: Literal["nominal", "off"] = "nominal"
    column: str = Field(default="supply_v", pattern=r"^[a-z][a-z0-9_]*_v$")  #: of the recording: the measured voltage

    @model_validator(mode="after")
    def _nominal_within(self) -> SupplySettings:
        if not self.min_v <= self.nominal_v <= self.max_v:
            raise ValueError(
                f"nominal_v = {self.nominal_v:g} V must lie between min_v = {self.min_v:g} and max_v = "
                f"{self.max_v:g} V; correct it"
            )
        return self


class GyroSettings(DeviceSettings):
    """One unit on the bench: address, identity and limits of exposure."""

    name: str
    serial: str = Field(pattern=SERIAL)
    own_serial: str | None = None  #: what the unit says of itself, where it does; another one is refused
    #: How the unit is to be set, by the names and texts with which it reports that; set otherwise, it is refused.
    configuration: dict[str, str] = Field(default_factory=dict)
    model: str = ""
    technology: Literal["fog", "mems", "piezo", ""] = ""
    axes: tuple[Literal["x", "y", "z"], ...] = ("z",)
    max_rate_dps: float = Field(gt=0)
    min_c: float = -40.0
    max_c: float = 85.0
    sample_rate_hz: float | None = None
    datasheet: dict[str, float] = Field(default_factory=dict)
    #: What the figures of `datasheet` are; a figure without an entry is what the maker's own sheet states.
    datasheet_conventions: dict[str, Convention] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _conventions_of_figures(self) -> GyroSettings:
        for name, value in self.datasheet.items():
            if not 0.0 <= value < math.inf:  # also true for NaN
                raise ValueError(f"datasheet: {name} = {value} is negative or no number; correct it, or leave it out")
        if text := undeclared(self.datasheet, self.datasheet_conventions):
            raise ValueError(f"datasheet_conventions: {text}")
        return self


class ReferenceSettings(DeviceSettings):
    """A reference thermometer or hygrometer: a separate instrument with its own traceable calibration."""

    name: str = "reference"
    serial: str = ""  #: of the readout; compared with what it says of itself, where it says something
    certificate: str = ""  #: of its calibration: number, laboratory and date
    u_c: float | None = Field(default=None, gt=0)  #: standard uncertainty of its temperature, K
    #: Whether its temperature is the one by which the units' readings are fitted.
    is_temperature: bool = False
    #: Column of the driver -> column of the recording, where two instruments would have the same.
    columns: dict[str, str] = Field(default_factory=dict)
    #: Column of the driver -> what the certificate adds to a reading, in the unit of the column.
    corrections: dict[str, float] = Field(default_factory=dict)


def _tilted(text: str) -> str:
    """Return a direction of a tilted fixture in its normal form; raises ValueError for another position."""
    position = Position.of(text)
    if not position.is_tilted or position.turned_deg:
        raise ValueError(
            f"{text!r} is no direction of a tilted fixture; give the sum of body axes that points up, such as x+y+z"
        )
    return position.end


TiltedPosition = Annotated[str, AfterValidator(_tilted)]
SettingsT = TypeVar("SettingsT", bound=BaseModel)


def part_of(section: DeviceSettings, model: type[SettingsT]) -> SettingsT:
    """Return the keys of a section that a model has, as that model; raises pydantic.ValidationError.

    A simulated instrument reads its own settings so: the section may be of another driver for the same wire.
    """
    stated = section.model_dump(exclude_unset=True)
    return model.model_validate({name: stated[name] for name in model.model_fields if name in stated})


class SimulationSettings(Strict):
    """Properties of the simulated instruments behind `sim://`; a bench of real instruments ignores them."""

    seed: int = 1
    noise_seed: int = 0  #: another value measures the same units on another day
    latitude_deg: float | None = None  #: of the simulated world; default: the bench's
    units: dict[str, dict[str, object]] = Field(default_factory=dict)  #: gyro name -> profile and deviations from it
    table: dict[str, object] = Field(default_factory=dict)
    chamber: dict[str, object] = Field(default_factory=dict)
    hand: dict[str, object] = Field(default_factory=dict)  #: of the person who turns the units of a bench by hand
    hidden: dict[str, float | str] = Field(default_factory=dict)  #: effect id -> size, hidden in every unit
    #: Whether the bench is off by errors drawn from the distributions of its [[standards]]; else it is exact.
    draw_standards: bool = False
    control: str | None = None  #: HOST:PORT of a simulator in another process, for its unit handler
    speed: float = Field(
        default=1.0, gt=0
    )  #: clock seconds per second of real time of that process; `labctl simulator` writes these three
    clock: str | None = None  #: file by which that process shares its clock; absent at speed 1


class DriverRelease(Strict):
    """Where a driver came from."""

    driver: str
    distribution: str
    version: str


class BenchFile(Strict):
    """A whole bench."""

    name: str
    latitude_deg: float | None = Field(default=None, ge=-90, le=90)
    table: SerializeAsAny[TableSettings] | None = None  #: absent: the units are turned by hand
    chamber: SerializeAsAny[ChamberSettings] | None = None  #: absent: the units are at room temperature
    supply: SerializeAsAny[SupplySettings] | None = None  #: absent: labctl neither sets nor logs the supply voltage
    gyros: tuple[SerializeAsAny[GyroSettings], ...] = Field(min_length=1)
    references: tuple[SerializeAsAny[ReferenceSettings], ...] = ()
    laboratory: Laboratory | None = None  #: as certificates name it
    standards: tuple[Standard, ...] = ()  #: reference standards, at most one of each quantity and name
    #: Directions of the body that a tilted fixture of the bench brings up, such as "x+y+z"; absent: it has none.
    tilted_positions: tuple[TiltedPosition, ...] = ()
    eccentricity: Eccentricity | None = None  #: absent: the units' distance from the table's axis is not known
    simulation: SimulationSettings | None = None
    #: Name of a section or gyro ("table", "supply" ...) -> its driver's release, filled in when the drivers are found;
    #: what a file says here is not used.
    drivers: dict[str, DriverRelease] = Field(default_factory=dict)
    #: Name of a section or gyro -> what the instrument and its USB adapter say of themselves (serial, firmware,
    #: adapter ...), filled in when a campaign is prepared.
    reported: dict[str, dict[str, str]] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _every_unit_is_one(self) -> BenchFile:
        """Reject two units with one name, serial number or port: their readings would be mixed."""
        for key in ("name", "serial", "port"):
            values = [value for unit in self.gyros if (value := getattr(unit, key)) is not None]
            if twice := next((value for value in values if values.count(value) > 1), None):
                raise ValueError(f"two gyros have the {key} {twice!r}; give each gyro a different one")
        return self

    @model_validator(mode="after")
    def _units_fit(self) -> BenchFile:
        """Reject more units than the table has places."""
        places = None if self.table is None else self.table.places
        if places is not None and len(self.gyros) > places:
            raise ValueError(
                f"table.places = {places}, but the file has {len(self.gyros)} units in [[gyros]]; correct places, or "
                "remove units"
            )
        return self

    @model_validator(mode="after")
    def _references_are_distinct(self) -> BenchFile:
        """Reject two instruments of one name, and a second reference as the temperature of the units."""
        names = ["table", "chamber", "supply", *(unit.name for unit in self.gyros)]
        for reference in self.references:
            if reference.name in names:
                raise ValueError(
                    f"two instruments have the name {reference.name!r}; give the one in [[references]] another name"
                )
            names.append(reference.name)
        if len(chosen := [each.name for each in self.references if each.is_temperature]) > 1:
            raise ValueError(
                f"is_temperature is set for {' and '.join(chosen)}, but a fit uses one "
                "temperature; set it for one of these columns"
            )
        return self

    @model_validator(mode="after")
    def _standards_are_distinct(self) -> BenchFile:
        """Reject one quantity stated twice under one name: its uncertainty would count twice."""
        stated = [(standard.quantity, standard.name) for standard in self.standards]
        if twice := next((one for one in stated if stated.count(one) > 1), None):
            raise ValueError(
                f"two [[standards]] have the quantity {twice[0]!r} and the name {twice[1]!r}; remove one, or "
                "give each a different name"
            )
        return self

    @property
    def air_tau_s(self) -> float | None:
        """Time constant of the chamber's air, s, as the file states or simulates it; None where it does neither."""
        stated = None if self.chamber is None else self.chamber.air_tau_s
        if stated is not None or self.simulation is None:
            return stated
        simulated = self.simulation.chamber.get("air_tau_s", USUAL_AIR_TAU_S)
        return float(simulated) if isinstance(simulated, int | float) else None  # another is refused when it is opened

    @property
    def units_at_once(self) -> int:
        """How many units one campaign measures: as many as fit on the table where the file says it."""
        return len(self.gyros) if self.table is None or self.table.places is None else self.table.places

    @property
    def is_simulated(self) -> bool:
        """Whether every instrument is reached by sim://."""
        return all(is_simulated_address(link) for link in self.links)

    @property
    def has_simulated(self) -> bool:
        """Whether any instrument is reached by sim://."""
        return any(is_simulated_address(link) for link in self.links)

    @property
    def needs_person(self) -> bool:
        """Whether a person turns and switches the units: no simulated unit handler does."""
        remote = self.simulation is not None and self.simulation.control is not None
        return not self.has_simulated and not remote

    @property
    def links(self) -> list[str]:
        """Every port and host."""
        devices = (*self.instruments.values(), *self.gyros, *self.references)
        return [link for device in devices for link in (device.port, device.host) if link is not None]

    @property
    def adapters(self) -> dict[str, str]:
        """Device -> serial number of the USB adapter that the file names for it."""
        return {name: section.adapter for name, section in self.sections.items() if section.adapter is not None}

    @property
    def sections(self) -> dict[str, DeviceSettings]:
        """Every device, by its name: table, chamber, supply, references, gyros."""
        references = {reference.name: reference for reference in self.references}
        return {**self.instruments, **references, **{gyro.name: gyro for gyro in self.gyros}}

    @property
    def instruments(self) -> dict[str, DeviceSettings]:
        """The table, the chamber and the supply, those that the bench has."""
        sections = {"table": self.table, "chamber": self.chamber, "supply": self.supply}
        return {name: section for name, section in sections.items() if section is not None}


def shipped_benches() -> dict[str, Path]:
    """Return name -> path of the bench files that are part of labctl."""
    folder = Path(str(resources.files("instruments"))) / "benches"
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}


def read_bench(source: str | Path) -> BenchFile:
    """Read a bench file by path, or a shipped one by name.

    Raises FileNotFoundError, tomllib.TOMLDecodeError, pydantic.ValidationError.
    """
    path = shipped_benches().get(str(source), Path(source))
    return BenchFile.model_validate(_with_formats(read_toml(path), path.parent))


def _with_formats(document: dict[str, object], folder: Path) -> dict[str, object]:
    """Return a document whose instruments have their formats and DBC files in place of the names of files beside it.

    A campaign keeps its bench file, and so the formats. The name of a file that is not there stays: its driver says so.
    Raises tomllib.TOMLDecodeError naming the file.
    """
    sections: list[object] = [document.get("table"), document.get("chamber")]
    for several in (document.get("gyros"), document.get("references")):
        sections += several if isinstance(several, list) else []
    for section in sections:
        if not isinstance(section, dict):
            continue
        described = section.get("format")
        if isinstance(described, str) and described.endswith(".toml") and (folder / described).is_file():
            try:
                section["format"] = read_toml(folder / described)
            except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
                raise tomllib.TOMLDecodeError(f"format {folder / described}: {error}") from error
        described = section.get("dbc")
        if isinstance(described, str) and described.endswith(".dbc") and (folder / described).is_file():
            section["dbc"] = _dbc_text(folder / described)
    return document


def _dbc_text(path: Path) -> str:
    """Return the text of a DBC file, which is of UTF-8 or, as most tools write it, of Windows' code page 1252."""
    with path.open("rb") as file:
        content = file.read(MAX_BYTES + 1)
    if len(content) > MAX_BYTES:
        raise tomllib.TOMLDecodeError(f"DBC file {path}: larger than {MAX_BYTES} bytes, the limit of such a file")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = content.decode("cp1252", errors="replace")
    return text.replace("\r\n", "\n")

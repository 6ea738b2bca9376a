"""Settings of a described chamber or table, as a bench file gives them, and the descriptions that ship with labctl."""

from __future__ import annotations

import difflib
from importlib import resources
from pathlib import Path
from typing import Literal

from pydantic import Field, field_validator, model_validator

from instruments.bench_config import TableSettings, is_simulated_address
from instruments.protocols.port_or_host import PortOrHostSettings
from instruments.protocols.request_reply.chamber import ChamberDescription
from instruments.protocols.request_reply.parts import Description
from instruments.protocols.request_reply.table import TableDescription
from instruments.protocols.serial_options import SerialOptions
from instruments.protocols.text_lines.chamber_settings import LineChamberSettings
from instruments.toml_documents import read_toml

Parameters = dict[str, str | int | float]


def shipped_descriptions() -> dict[str, Path]:
    """Return name -> path of the descriptions that are part of labctl."""
    folder = Path(str(resources.files("instruments"))) / "line_formats"
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}


def found_description(document: object) -> object:
    """Return the document of a shipped description for its name; anything else as it is. Raises ValueError."""
    if not isinstance(document, str):
        return document
    if document.endswith(".toml"):
        raise ValueError(
            f"the folder of the bench file has no file {document!r}; correct the name, or put the file there"
        )
    shipped = shipped_descriptions()
    if document in shipped:
        return read_toml(shipped[document])
    near = difflib.get_close_matches(document, shipped, n=1)
    hint = f"did you mean {near[0]!r}? If not, " if near else ""
    raise ValueError(
        f"no description {document!r} comes with labctl (those that do: {', '.join(shipped)}); {hint}name one of "
        "these, or a .toml file in the folder of the bench file"
    )


def with_line(document: object) -> object:
    """Return settings with baud rate and TCP port of their description, where the bench file gives none."""
    if not isinstance(document, dict):
        return document
    description = document.get("format")
    if isinstance(description, str) and description in shipped_descriptions():
        description = read_toml(shipped_descriptions()[description])
    usual: dict[str, object] = {}
    if isinstance(description, Description):
        usual = description.line.model_dump()
    elif isinstance(description, dict) and isinstance(line := description.get("line"), dict):
        usual = line
    kept = {key: usual[key] for key in ("baudrate", "tcp_port") if usual.get(key) is not None}
    return {**kept, **{key: value for key, value in document.items() if value is not None}, "format": description}


def parameters_of(description: Description, parameters: Parameters) -> Parameters:
    """Return the parameters of a description with those of the bench file; raises ValueError for one it has not."""
    for name, value in parameters.items():
        if name not in description.parameters:
            names = ", ".join(description.parameters) or "none"
            raise ValueError(
                f"parameters: {description.name!r} has no parameter {name!r} (it has: {names}); correct it"
            )
        if not str(value).isprintable() or not str(value):
            raise ValueError(f"parameters: {name} = {value!r} is not a printable text; correct it")
    return {**description.parameters, **parameters}


class DescribedChamberSettings(LineChamberSettings):
    """A chamber and its description: the name of a shipped one, a file beside the bench file, or a table."""

    format: ChamberDescription
    serial: str = ""  #: of the controller; compared with what it says of itself
    tcp_port: int = 0
    parameters: Parameters = Field(default_factory=dict)

    _line = model_validator(mode="before")(with_line)
    _found = field_validator("format", mode="before")(found_description)

    @model_validator(mode="after")
    def _usable(self) -> DescribedChamberSettings:
        parameters_of(self.format, self.parameters)
        require_tcp_port(self.host, self.tcp_port)
        if not self.format.min_c <= self.safe_c <= self.format.max_c:
            raise ValueError(
                f"safe_c = {self.safe_c:g} deg C is beyond the limits of {self.format.name!r}, {self.format.min_c:g} "
                f"to {self.format.max_c:g} deg C; correct it"
            )
        if self.safe_state == "off" and not self.format.switch_off:
            raise ValueError(
                f'safe_state = "off", but the description {self.format.name!r} does not say how the chamber is '
                'switched off; add switch_off and [running] to it, or set safe_state = "setpoint"'
            )
        return self


class DescribedTableSettings(PortOrHostSettings, TableSettings):
    """A table and its description."""

    format: TableDescription
    serial: str = ""  #: of the controller; compared with what it says of itself
    tcp_port: int = 0
    baudrate: int = Field(default=9600, gt=0)
    options: SerialOptions = Field(default_factory=SerialOptions)
    parameters: Parameters = Field(default_factory=dict)
    direction: Literal[1, -1] = 1  #: -1 where a positive rate turns the table clockwise, seen from above
    #: Reference of readings: the rate that was asked for, or that of the positions, where they are measured.
    reference: Literal["demanded", "measured"] = "demanded"

    _line = model_validator(mode="before")(with_line)
    _found = field_validator("format", mode="before")(found_description)

    @model_validator(mode="after")
    def _usable(self) -> DescribedTableSettings:
        require_tcp_port(self.host, self.tcp_port)
        parameters_of(self.format, self.parameters)
        for what, unit, requested, limit in (
            ("max_rate_dps", "deg/s", self.max_rate_dps, self.format.max_rate_dps),
            ("acceleration_dps2", "deg/s2", self.acceleration_dps2, self.format.max_acceleration_dps2),
        ):
            if requested > limit:
                raise ValueError(
                    f"{what} = {requested:g} {unit} is beyond the limit of {self.format.name!r}, {limit:g} {unit}; "
                    "lower it"
                )
        if self.reference == "measured" and not self.format.encoder:
            raise ValueError(
                f'reference = "measured", but the position of {self.format.name!r} is not measured (encoder = false '
                'in its description); set reference = "demanded"'
            )
        return self


def require_tcp_port(host: str | None, tcp_port: int) -> None:
    """Raise ValueError for a real host without a port."""
    if host is not None and not is_simulated_address(host) and not tcp_port:
        raise ValueError("tcp_port is missing: neither the description nor the bench file gives it; add tcp_port")

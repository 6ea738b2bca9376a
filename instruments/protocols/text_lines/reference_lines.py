"""Reference thermometers and hygrometers that are asked by lines of text: what to ask each model, as data.

Any other instrument of the kind needs no code: a bench file gives `identity` and `quantities` itself.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pydantic import Field, field_validator, model_validator

from instruments.bench_config import ReferenceSettings
from instruments.protocols.port_or_host import PortOrHostSettings
from instruments.protocols.request_reply.reference import ReferenceDescription
from instruments.protocols.request_reply.settings import found_description, with_line
from instruments.protocols.serial_options import SerialOptions
from instruments.protocols.text_lines.quantity import CELSIUS, Quantity


@dataclass(frozen=True)
class ReferenceModel:
    """One model of instrument."""

    title: str
    source: str
    identity: str  #: the request; empty: it reports no identity
    serial: str  #: pattern of the reply; group `serial`
    quantities: dict[str, Quantity]
    end: str = "\r\n"
    baudrate: int = 9600
    tcp_port: int = 0


#: Manufacturer, model, serial number, firmware: what SCPI instruments answer to *IDN?.
IDN = r"[^,]*,[^,]*,\s*(?P<serial>[^,]*?)\s*(?:,.*)?"
TEMPERATURE, HUMIDITY = "reference_c", "humidity_pct"
PERCENT = Quantity(ask="*SRH", unit="%", resolution=1e-3)
MODELS: dict[str, ReferenceModel] = {
    "fluke-1529": ReferenceModel(
        "Fluke 1529 Chub-E4", "Fluke 1529 manual p. 87 (FETCh? [<chn>]), 7.3.2", "*IDN?", IDN,
        {TEMPERATURE: Quantity(ask="FETC? {input}")}, end="\r",
    ),
    "fluke-1524": ReferenceModel(
        "Fluke 1523/1524", "as the 1529 of the same maker; its own guide was not at hand", "*IDN?", IDN,
        {TEMPERATURE: Quantity(ask="FETC? {input}")}, end="\r",
    ),
    "fluke-1502a": ReferenceModel(
        "Hart/Fluke 1502A, 1504", "Fluke 1504 manual p. 30, 7.3.1.1 (T, FETCH?, *IDN?)", "*IDN?", IDN,
        {TEMPERATURE: Quantity(ask="T", pattern=CELSIUS)}, end="\r", baudrate=2400,
    ),
    "fluke-1521": ReferenceModel(
        "Hart/Fluke 1521, 1522", "Fluke 1521 manual p. 42, 1522 manual p. 48, 8.2.1", "", "",
        {TEMPERATURE: Quantity(ask="FETCH?", pattern=CELSIUS)}, end="\r", baudrate=2400,
    ),
    "omega-ithx": ReferenceModel(
        "Omega iTHX", "MSLNZ/msl-equipment 51b9be3, omega/ithx.py (*SRTC, *SRH)", "", "",
        {TEMPERATURE: Quantity(ask="*SRTC", resolution=1e-3), HUMIDITY: PERCENT}, end="\r", tcp_port=2000,
    ),
}  # fmt: skip


class LineReferenceSettings(PortOrHostSettings, ReferenceSettings):
    """A model that is known, a description of another, or identity and quantities of any other."""

    format: ReferenceDescription | None = None
    model: str = ""
    baudrate: int | None = Field(default=None, gt=0)
    tcp_port: int = 0
    options: SerialOptions = Field(default_factory=SerialOptions)
    input: int = Field(default=1, ge=1)  #: of a readout with several probes
    end: str | None = None  #: line end of a request
    identity: str | None = None
    quantities: dict[str, Quantity] = Field(default_factory=dict)  #: column -> how it is asked for

    @model_validator(mode="before")
    @classmethod
    def _as_described(cls, document: Any) -> Any:
        """Take what the description says where the bench file says nothing."""
        if not isinstance(document, dict) or document.get("format") is None:
            return document
        lined = with_line(document)
        if not isinstance(lined, dict) or not isinstance(description := lined["format"], dict):
            return lined
        line = description.get("line")
        usual = {key: description[key] for key in ("identity", "quantities") if key in description}
        return usual | {"end": line.get("end", "\r\n") if isinstance(line, dict) else "\r\n"} | lined

    _found = field_validator("format", mode="before")(found_description)

    @field_validator("model")
    @classmethod
    def _is_known(cls, model: str) -> str:
        if model and model not in MODELS:
            raise ValueError(
                f"model {model!r} is not known; choose one of {', '.join(MODELS)}, or leave model out and state each "
                "quantity in quantities"
            )
        return model

    @model_validator(mode="after")
    def _is_complete(self) -> LineReferenceSettings:
        if self.model and self.format is not None:
            raise ValueError("model and format both say which instrument it is; keep one of the two")
        if not self.model and not self.quantities:
            raise ValueError(
                f"model and quantities are missing; give model ({', '.join(MODELS)}), or for "
                "another instrument its quantities"
            )
        return self

    @property
    def known(self) -> ReferenceModel:
        """The model, with what the bench file says otherwise."""
        model = MODELS.get(self.model) or ReferenceModel(
            "reference" if self.format is None else self.format.name, "the bench file", "", IDN, {}
        )
        return ReferenceModel(
            model.title, model.source, model.identity if self.identity is None else self.identity, model.serial or IDN,
            self.quantities or model.quantities, model.end if self.end is None else self.end,
            self.baudrate or model.baudrate, self.tcp_port or model.tcp_port,
        )  # fmt: skip

    @property
    def address_url(self) -> str:
        """Address of the port."""
        return self._address_url(self.known.tcp_port)

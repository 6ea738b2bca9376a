"""Settings of a device that is at a serial port or behind a TCP port of a host: exactly one of the two is given."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from pydantic import BaseModel, model_validator


class PortOrHostSettings(BaseModel):
    """Mixed into the settings of a kind of instrument: `class MyChamber(PortOrHostSettings, ChamberSettings)`.

    It has no keys of its own: those of the kind of instrument keep their defaults, and their order in stored files.
    """

    if TYPE_CHECKING:  # keys of `instruments.bench_config.DeviceSettings`
        port: str | None = None
        host: str | None = None
        tcp_port: int = 0

    address_error: ClassVar[str] = "give either port (a serial port), or host with tcp_port (a network address)"

    @model_validator(mode="after")
    def _has_one_address(self) -> PortOrHostSettings:
        self._require_address()
        return self

    def _require_address(self) -> None:
        """Raise ValueError for none of port and host, or both."""
        if (self.port is None) == (self.host is None):
            raise ValueError(self.address_error)

    @property
    def address_url(self) -> str:
        """Address of the port: a serial one, or a TCP socket of a host; empty where neither is given."""
        return self._address_url(self.tcp_port)

    def _address_url(self, tcp_port: int) -> str:
        if self.port is not None:
            return self.port
        if self.host is None or "://" in self.host:
            return self.host or ""
        return f"socket://{self.host}:{tcp_port}"

"""A gyro whose output is a voltage, read by fast analog inputs: wiring and averaging, as a bench file gives them."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from instruments.bench_config import GyroSettings, Strict, is_simulated_address
from instruments.protocols.nidaqmx.service import SERVER_PORT
from instruments.protocols.uldaq_library import DISCOVERY_PORT

#: Rates of the inputs, scans per second.
DEFAULT_SCANS_PER_S = 1000.0


class AnalogOptions(Strict):
    """One input for each axis, and one for a thermometer where there is one."""

    inputs: tuple[int, ...] = (0,)  #: of the axes, in their order
    rest_v: float = 2.5
    v_per_dps: float = 0.022
    range_v: float = Field(default=10.0, gt=0)  #: largest voltage of the inputs
    differential: bool = False
    #: Scans whose mean is one reading; the reading's time is that of the last of them.
    average: int = Field(default=1, ge=1, le=10000)
    thermometer_input: int | None = None
    thermometer_c_per_v: float = 20.0
    thermometer_zero_c: float = -25.0  #: temperature at 0 V

    @property
    def all_inputs(self) -> tuple[int, ...]:
        """Every input that is scanned, the thermometer's last."""
        return self.inputs if self.thermometer_input is None else (*self.inputs, self.thermometer_input)


class AnalogSettings(GyroSettings):
    """`sample_rate_hz` is the rate of the inputs, scans per second; a reading is the mean of `average` of them."""

    options: AnalogOptions = Field(default_factory=AnalogOptions)

    @model_validator(mode="after")
    def _wired(self) -> AnalogSettings:
        inputs = self.options.all_inputs
        if len(self.options.inputs) != len(self.axes):
            raise ValueError(
                f"options.inputs has {len(self.options.inputs)} inputs for {len(self.axes)} axes; give one "
                "input for each axis"
            )
        if len(set(inputs)) < len(inputs):
            raise ValueError(
                f"options.inputs {inputs}: one input is given for two signals; give each signal a different input"
            )
        return self

    @property
    def scans_per_s(self) -> float:
        """Rate of the inputs."""
        return self.sample_rate_hz or DEFAULT_SCANS_PER_S


class LabJackSettings(AnalogSettings):
    """A LabJack T7 or T4. `port` is where its stream comes from: by default TCP port 702 of `host`."""

    tcp_port: int = 502
    stream_port: int = 702
    resolution_index: int = Field(default=0, ge=0, le=8)  #: of the stream; 0: the device's own choice
    settling_us: float = Field(default=0.0, ge=0)

    @model_validator(mode="after")
    def _has_host(self) -> LabJackSettings:
        if self.host is None:
            raise ValueError("key host is missing; give the network address of the LabJack")
        return self

    @property
    def stream_url(self) -> str:
        """Address of the stream."""
        return self.port or f"socket://{self.host}:{self.stream_port}"


class NidaqSettings(AnalogSettings):
    """A device of National Instruments, by the name that its driver software gives it.

    Without `host` the driver software is that of this computer; else that of a computer on the network, behind NI's
    gRPC device server.
    """

    device: str = "Dev1"
    tcp_port: int = Field(default=SERVER_PORT, ge=1, le=65535)  #: of the server
    terminals: Literal["default", "rse", "nrse", "differential"] = "default"

    @model_validator(mode="after")
    def _has_plain_host(self) -> NidaqSettings:
        if self.port is not None:
            raise ValueError("key port is not used; give the network address of NI's gRPC device server as host")
        if self.host is not None and "/" in self.host and not is_simulated_address(self.host):
            raise ValueError(
                f"host = {self.host!r} is not a network address; give the name or the IP address alone, its port as "
                "tcp_port, and the device as device"
            )
        return self

    @property
    def address(self) -> str:
        """Device, and where it is not at this computer, its server."""
        if self.host is None:
            return self.device
        server = self.host if is_simulated_address(self.host) else f"{self.host}:{self.tcp_port}"
        return f"{self.device} at {server}"


class MccSettings(AnalogSettings):
    """A device of Measurement Computing: at the USB of this computer, or with `host` one with Ethernet."""

    device: str = ""  #: unique ID (serial number) or product name of a USB device; empty: the only one that is found
    tcp_port: int = Field(default=DISCOVERY_PORT, ge=1, le=65535)  #: at which an Ethernet device is found

    @model_validator(mode="after")
    def _is_somewhere(self) -> MccSettings:
        if self.port is not None:
            raise ValueError("key port is not used; give the unique ID of a USB device as device, or host")
        if self.host is not None and self.device:
            raise ValueError("keys host and device are both given; keep host for an Ethernet device, device for USB")
        if self.host is not None and "/" in self.host and not is_simulated_address(self.host):
            raise ValueError(
                f"host = {self.host!r} is not a network address; give the name or the IP address of the device alone"
            )
        return self

    @property
    def address(self) -> str:
        """Device, as an error names it."""
        return self.host or self.device or "the USB device"

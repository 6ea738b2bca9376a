"""Advantech ADAM-6017 analog input module: registers, input ranges, and how a Gyrostar is wired to the module.

Registers and range codes are from public drivers of the module. The rate output of 2.5 V at rest and 22 mV per deg/s is
from the Weiss report on the Gyrostar ENV-05S.
"""

from __future__ import annotations

from typing import Literal

from pydantic import Field, ValidationInfo, field_validator

from instruments.bench_config import GyroSettings, Strict
from instruments.protocols.modbus_registers import Register

SOURCE = "public ADAM-6017 drivers"
INPUT = Register(0, "analog input", unit="counts", source=SOURCE)
RANGE_CODE = Register(200, "range code of input", source=SOURCE)
MODULE_NAME = Register(210, "module name", source=SOURCE)
MODULE_6017 = 0x6017
CHANNELS = 8
FULL_CODE = 65535
#: The module clips to its range: a code at or below RAIL_LOW or above RAIL_HIGH is not a measurement.
RAIL_LOW, RAIL_HIGH = 0, 65500
#: Range code -> (lowest, highest) voltage, V: the voltages of codes 0 and FULL_CODE.
RANGES_V = {
    0x0103: (-0.15, 0.15),
    0x0104: (-0.5, 0.5),
    0x0105: (0.0, 0.15),
    0x0106: (0.0, 0.5),
    0x0140: (-1.0, 1.0),
    0x0142: (-5.0, 5.0),
    0x0143: (-10.0, 10.0),
    0x0145: (0.0, 1.0),
    0x0147: (0.0, 5.0),
    0x0148: (0.0, 10.0),
}


class WiringOptions(Strict):
    """Inputs of the module that carry the rate and, where one is fitted, a thermometer: the Gyrostar has none."""

    channel: int = Field(default=0, ge=0, lt=CHANNELS)
    range_code: int = 0x0147
    rest_v: float = 2.5
    v_per_dps: float = 0.022
    thermometer_channel: int | None = Field(default=None, ge=0, lt=CHANNELS)
    thermometer_range_code: int = 0x0147
    thermometer_c_per_v: float = 20.0
    thermometer_zero_c: float = -25.0  #: temperature at 0 V
    address: int = Field(default=1, ge=0, le=255)
    read_function: Literal[3, 4] = 4  #: known modules answer both functions for inputs and range codes

    @field_validator("range_code", "thermometer_range_code")
    @classmethod
    def _is_known(cls, code: int) -> int:
        if code not in RANGES_V:
            codes = ", ".join(f"0x{codes:04X}" for codes in RANGES_V)
            raise ValueError(
                f"input range code 0x{code:04X} is not a voltage range of the ADAM-6017; choose one of {codes}"
            )
        return code

    @field_validator("thermometer_channel")
    @classmethod
    def _is_another(cls, channel: int | None, info: ValidationInfo) -> int | None:
        if channel is not None and channel == info.data.get("channel"):
            raise ValueError(
                f"input {channel} is given both for the rate and for the thermometer; give each a different input"
            )
        return channel

    @property
    def range_codes(self) -> dict[int, int]:
        """Input number -> range code of the inputs in use; the input of the rate comes first."""
        codes = {self.channel: self.range_code}
        if self.thermometer_channel is not None:
            codes[self.thermometer_channel] = self.thermometer_range_code
        return codes


class GyrostarSettings(GyroSettings):
    """Settings of a Gyrostar on an ADAM-6017, as a bench file gives them."""

    options: WiringOptions = Field(default_factory=WiringOptions)

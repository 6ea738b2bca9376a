"""Register numbers, strides and codes as the sources list them, typed here a second time: drivers and simulators share
one table, so nothing else would notice a wrong number in it."""

from __future__ import annotations

from types import ModuleType

import pytest

from instruments.protocols import adam6017, watlow_f4_registers, watlow_f4t_registers
from instruments.protocols.modbus_registers import Register

F4 = {
    "MODEL": 0, "AIR": 100, "MODE": 200, "INPUT_STATE": 201, "SETPOINT": 300, "SETPOINT_LOW": 602, "SETPOINT_HIGH": 603,
    "DECIMALS": 606, "UNITS": 608, "SCALE": 901, "INPUT_FUNCTION": 1060, "INPUT_ACTIVE": 1061, "TERMINATE": 1217,
    "EVENT": 2000, "CURRENT_PROFILE": 4100,
}  # fmt: skip
F4T = {
    "PART_NUMBER": 16, "STATUS": 90, "ALARM": 1356, "SETPOINT_LOW": 2774, "SETPOINT_HIGH": 2776, "SETPOINT": 2782,
    "CONTROL_MODE": 2814, "AIR": 2820, "ETHERNET_UNITS": 6730, "PROFILE_ACTION": 16566, "PROFILE_STATE": 16568,
    "CASCADE_MODE": 4012, "CASCADE_LOW": 4034, "CASCADE_HIGH": 4036, "CASCADE_SETPOINT": 4042, "CASCADE_AIR": 4182,
    "LIMIT_STATE": 11250, "LIMIT_STATUS": 11264, "LIMIT_ERROR": 11288, "OUTPUT": 33718,
}  # fmt: skip
ADAM_6017 = {"INPUT": 0, "RANGE_CODE": 200, "MODULE_NAME": 210}


@pytest.mark.parametrize(
    ("table", "numbers"), [(watlow_f4_registers, F4), (watlow_f4t_registers, F4T), (adam6017, ADAM_6017)]
)
def test_register_numbers(table: ModuleType, numbers: dict[str, int]) -> None:
    declared = {name: value.number for name, value in vars(table).items() if isinstance(value, Register)}
    assert declared == numbers


@pytest.mark.parametrize(
    ("table", "constants"),
    [
        (
            watlow_f4_registers,
            {
                "INPUT_STRIDE": 12, "INPUT_SETUP_STRIDE": 2, "EVENT_STRIDE": 10, "MODEL_F4": 5270,
                "FUNCTION_WAIT_FOR": 10, "AIR_COUNTS": (7, 3, 1),
                "ALARM_OFFSETS": {1: 2, 2: 6}, "INPUT_ERROR": 1, "MODE_STATIC": 0, "MODE_PROFILE_RUNNING": 2,
                "MODE_PROFILE_HELD": 3, "TERMINATE_PROFILE": 1,
            },
        ),
        (
            watlow_f4t_registers,
            {
                "STATUS_OK": 138, "UNITS_CELSIUS": 15, "ALARM_STRIDE": 100, "ALARM_QUIET": {88, 61, 12},
                "LIMIT_STRIDE": 60, "LIMIT_MODULES": 6, "FAIL": 32, "ERROR": 28, "NONE": 61, "MODULE_STRIDE": 240,
                "OUTPUT_STRIDE": 40, "ON": 63, "MODE_AUTO": 10, "PROFILE_ACTIVE": {149, 146},
                "PROFILE_TERMINATE": 148, "PROFILE_NOT_STARTED": 1782,
            },
        ),
        (adam6017, {"MODULE_6017": 0x6017, "CHANNELS": 8, "FULL_CODE": 65535, "RAIL_LOW": 0, "RAIL_HIGH": 65500}),
    ],
)  # fmt: skip
def test_strides_and_codes(table: ModuleType, constants: dict[str, object]) -> None:
    assert {name: getattr(table, name) for name in constants} == constants


@pytest.mark.parametrize(
    ("part", "alarms", "cascade"),
    [
        ("F4T1A1A1A1A1A1A", 6, False),
        ("F4T1A1B1A1A1A1A", 8, False),
        ("F4T1A1C1A1A1A1A", 14, False),
        ("F4T1A1D1A1A6A1A", 6, True),
        ("F4T1A1E1A1A4A1A", 8, False),
        ("F4T1A1F1A1ACA1A", 14, True),
        ("F4T", 6, False),
    ],
)
def test_what_an_f4t_has_by_its_part_number(part: str, alarms: int, cascade: bool) -> None:
    assert (watlow_f4t_registers.alarms_of(part), watlow_f4t_registers.has_cascade(part)) == (alarms, cascade)

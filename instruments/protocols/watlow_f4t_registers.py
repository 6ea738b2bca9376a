"""Registers of the Watlow F4T, data map 1, control loop 1: 32-bit floats in two registers.

The low word comes first unless the controller is configured otherwise. Sources: F4T user's manual pp. 222-234;
ChamberConnectLibrary, watlowf4t.py.
"""

from __future__ import annotations

from dataclasses import dataclass

from instruments.protocols.modbus_registers import Register

MANUAL, CCL = "F4T manual pp. 222-234", "ChamberConnectLibrary, watlowf4t.py"
#: Plausible temperatures of a chamber, deg C; a float with its words exchanged nearly always lies outside.
COLDEST_C, HOTTEST_C = -200.0, 500.0

PART_NUMBER = Register(16, "part number", source=f"{CCL}; {MANUAL}")
STATUS = Register(90, "device status", source=MANUAL)
ALARM = Register(1356, "state of alarm", source=MANUAL)
CONTROL_MODE = Register(2814, "control mode", source=CCL)
SETPOINT_LOW = Register(2774, "set point minimum", "float32", "deg C", COLDEST_C, HOTTEST_C, source=CCL)
SETPOINT_HIGH = Register(2776, "set point maximum", "float32", "deg C", COLDEST_C, HOTTEST_C, source=CCL)
SETPOINT = Register(2782, "set point", "float32", "deg C", COLDEST_C, HOTTEST_C, access="rw", source=CCL)
AIR = Register(2820, "air temperature", "float32", "deg C", COLDEST_C, HOTTEST_C, source=CCL)
CASCADE_MODE = Register(4012, "cascade control mode", source=CCL)
CASCADE_LOW = Register(4034, "cascade set point minimum", "float32", "deg C", COLDEST_C, HOTTEST_C, source=CCL)
CASCADE_HIGH = Register(4036, "cascade set point maximum", "float32", "deg C", COLDEST_C, HOTTEST_C, source=CCL)
CASCADE_SETPOINT = Register(
    4042, "cascade set point", "float32", "deg C", COLDEST_C, HOTTEST_C, access="rw", source=CCL
)
CASCADE_AIR = Register(4182, "cascade air temperature", "float32", "deg C", COLDEST_C, HOTTEST_C, source=CCL)
LIMIT_STATE = Register(11250, "state of limit module", source=CCL)
LIMIT_STATUS = Register(11264, "status of limit module", source=CCL)
LIMIT_ERROR = Register(11288, "error of limit module", source=CCL)
OUTPUT = Register(33718, "state of output", source=CCL)
ETHERNET_UNITS = Register(6730, "units on Ethernet", source=CCL)
PROFILE_ACTION = Register(16566, "profile action", low=148, high=148, access="w", source=CCL)
PROFILE_STATE = Register(16568, "profile state", source=CCL)

PART_NUMBER_LETTERS = 15
STATUS_OK, UNITS_CELSIUS = 138, 15
ALARM_STRIDE = 100
NONE = ALARM_NONE = 61
LIMIT_MODULES, LIMIT_STRIDE = 6, 60
FAIL, ERROR = 32, 28
MODULE_STRIDE, OUTPUT_STRIDE, ON, OFF = 240, 40, 63, 62
ALARM_QUIET = frozenset({88, ALARM_NONE, 12})  #: startup, none, blocked
MODE_AUTO, MODE_OFF, MODES = 10, 62, {10: "auto", 54: "manual", 62: "off"}
PROFILE_ACTIVE = frozenset({149, 146})  #: running, paused
PROFILE_NOT_STARTED = 1782
PROFILE_TERMINATE = 148
RESOLUTION_C = 0.1

#: Digit 7 of the part number -> alarms; digit 12 -> cascade loops (ChamberConnectLibrary, process_controller).
ALARMS_OF = {"A": 6, "B": 8, "C": 14, "D": 6, "E": 8, "F": 14}
CASCADES_OF = {**dict.fromkeys("6789", 1), **dict.fromkeys("ABC", 2)}
FEWEST_ALARMS = 6


@dataclass(frozen=True)
class ControlLoop:
    """The registers of the loop that controls the air."""

    mode: Register
    low: Register
    high: Register
    setpoint: Register
    air: Register


LOOP = ControlLoop(CONTROL_MODE, SETPOINT_LOW, SETPOINT_HIGH, SETPOINT, AIR)
CASCADE = ControlLoop(CASCADE_MODE, CASCADE_LOW, CASCADE_HIGH, CASCADE_SETPOINT, CASCADE_AIR)


def alarms_of(part_number: str) -> int:
    """Return how many alarms a controller has by its part number."""
    return ALARMS_OF.get(part_number[6:7], FEWEST_ALARMS)


def has_cascade(part_number: str) -> bool:
    """Return whether a controller has a cascade loop by its part number."""
    return CASCADES_OF.get(part_number[11:12], 0) > 0

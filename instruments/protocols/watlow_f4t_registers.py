"""Registers of the Watlow F4T, data map 1, control loop 1: 32-bit floats in two registers.

The low word comes first unless the controller is configured otherwise. Sources: F4T user's manual pp. 222-234;
ChamberConnectLibrary, watlowf4t.py.
"""

from __future__ import annotations

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
ETHERNET_UNITS = Register(6730, "units on Ethernet", source=CCL)
PROFILE_ACTION = Register(16566, "profile action", low=148, high=148, access="w", source=CCL)
PROFILE_STATE = Register(16568, "profile state", source=CCL)

PART_NUMBER_LETTERS = 15
STATUS_OK, UNITS_CELSIUS = 138, 15
ALARMS, ALARM_STRIDE = 4, 100
ALARM_NONE = 61
ALARM_QUIET = frozenset({88, ALARM_NONE, 12})  #: startup, none, blocked
MODE_AUTO, MODES = 10, {10: "auto", 54: "manual", 62: "off"}
PROFILE_ACTIVE = frozenset({149, 146})  #: running, paused
PROFILE_NOT_STARTED = 1782
PROFILE_TERMINATE = 148
RESOLUTION_C = 0.1

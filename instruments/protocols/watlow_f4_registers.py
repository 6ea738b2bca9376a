"""Registers of the Watlow Series F4: signed 16-bit counts with implied decimals.

No complete register list of this controller is public. The numbers come from projects that operate real chambers
(ChamberConnectLibrary of Espec North America; gateways for the F4); a number that only one of them shows is a setting
of the bench file.
"""

from __future__ import annotations

from instruments.protocols.modbus_registers import Register

CCL = "ChamberConnectLibrary, watlowf4.py"
FIELD = "seen on real chambers by several gateways"
#: The controller needs this pause between two requests, s (ChamberConnectLibrary, modbus.py).
PAUSE_S = 0.03
#: Counts at or below this value are codes for absent or broken sensors (Watlow communications guide).
LOWEST_COUNT = -31999

MODEL = Register(0, "model", source="pymodbus driver of an F4 chamber")
#: Then the error of input 1 (101), alarm 1 (102), the outputs, input 2 and alarm 2 (106), where the model has them.
AIR = Register(
    100, "air temperature", "int16", "counts", low=LOWEST_COUNT, source=FIELD,
    below="the code of a sensor break",
)  # fmt: skip
#: Then the state of digital input 1 (201).
MODE = Register(200, "mode", low=0, high=3, source=CCL)
INPUT_STATE = Register(201, "state of digital input", source=CCL)
SETPOINT = Register(300, "set point", "int16", "counts", low=LOWEST_COUNT, access="rw", source=FIELD)
SETPOINT_LOW = Register(602, "set point low limit", "int16", "counts", access="rw", source=CCL)
SETPOINT_HIGH = Register(603, "set point high limit", "int16", "counts", access="rw", source=CCL)
DECIMALS = Register(606, "decimals of input 1", low=0, high=3, source=CCL)
UNITS = Register(608, "units of input 1", low=0, high=3, source=CCL)
SCALE = Register(901, "temperature scale", source=CCL)
INPUT_FUNCTION = Register(1060, "function of digital input", source=CCL)
INPUT_ACTIVE = Register(1061, "active state of digital input", source=CCL)
CURRENT_PROFILE = Register(4100, "number of the profile", source=CCL)
TERMINATE = Register(1217, "end of the profile", low=1, high=1, access="w", source=CCL)
EVENT = Register(2000, "event output", low=0, high=1, access="rw", source=CCL)
INPUT_STRIDE, INPUT_SETUP_STRIDE, EVENT_STRIDE = 12, 2, 10
INPUTS, EVENTS = 4, 8

MODEL_F4, EVENT_ON = 5270, 1
UNITS_TEMPERATURE, SCALE_FAHRENHEIT = 0, 0
MODE_STATIC, MODE_PROFILE_RUNNING, MODE_PROFILE_HELD = 0, 2, 3
TERMINATE_PROFILE = 1
#: A sister model, the F4P, has no profiles: its mode is 1 automatic, 2 manual (F4P manual).
MODE_MANUAL_F4P = 2
PROFILES = range(1, 41)
#: Words of one read, in the order of trying: each of air, set point and mode has a length of its own.
AIR_COUNTS, MODE_COUNTS = (7, 3, 1), (2, 1)
#: Offsets from AIR: error of input 1, alarms 1 and 2; an alarm's state is 0 off, 1 high, 2 low (F4P manual).
INPUT_ERROR, ALARM_OFFSETS, ALARM_STATES = 1, {1: 2, 2: 6}, {1: "high", 2: "low"}
INPUT_ERRORS = range(1, 32)  #: larger values are codes for a register that is not there
#: Digital input function: a profile waits for the input, so the input is not an alarm.
FUNCTION_WAIT_FOR = 10

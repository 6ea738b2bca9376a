"""Names and numbers of the service nidaqmx_grpc.NiDAQmx, from the interface file nidaqmx.proto of NI's server.

Every request about a task has it in field 1, and every reply its status.
"""

from __future__ import annotations

from enum import IntEnum

SERVICE = "nidaqmx_grpc.NiDAQmx"
#: Installs what calls the service, and what calls the driver software of this computer.
INSTALL_GRPC, INSTALL = "pip install labctl[nidaq-grpc]", "pip install labctl[nidaq]"
#: TCP port of the server, where its configuration file names no other.
SERVER_PORT = 31763

# Fields that all messages share.
TASK = 1
TASK_NAME = 1  #: of the message that identifies a task
STATUS = 1
VALUE = 2  #: of the reply to a question for an attribute
RAW_VALUE = 3  #: of such a reply where the value is one of an enumeration


class CreateTask(IntEnum):
    """Fields of the request and of its reply."""

    NAME = 1
    BEHAVIOUR = 2
    REPLY_TASK = 2
    REPLY_IS_NEW = 3


class Behaviour(IntEnum):
    """What CreateTask does where a task of the name exists already, and where none does."""

    EITHER = 0
    INITIALIZE = 1
    ATTACH = 2


class VoltageChannel(IntEnum):
    """Fields of CreateAIVoltageChan."""

    PHYSICAL = 2
    TERMINALS = 5
    MIN_V = 6
    MAX_V = 7


class SampleClock(IntEnum):
    """Fields of CfgSampClkTiming."""

    RATE_HZ = 3
    MODE = 7
    SAMPLES = 8


class ReadAnalog(IntEnum):
    """Fields of ReadAnalogF64 and of its reply."""

    SAMPLES = 2
    ARRAY_SIZE = 6
    REPLY_ARRAY = 2
    REPLY_SAMPLES = 3


#: Field of the attribute's number, by the question: after the task, and the channel or device where there is one.
ATTRIBUTE = {
    "GetSystemInfoAttributeUInt32": 2,
    "GetTaskAttributeString": 3,
    "GetTimingAttributeDouble": 3,
    "GetTimingAttributeInt32": 3,
    "GetReadAttributeUInt32": 3,
    "GetReadAttributeString": 3,
    "GetChanAttributeInt32": 4,
    "GetDeviceAttributeString": 3,
}
#: Questions whose reply is one of an enumeration.
ENUMERATED = frozenset({"GetTimingAttributeInt32", "GetChanAttributeInt32"})


class Attribute(IntEnum):
    """Numbers of the attributes that a client asks for."""

    MAJOR_VERSION = 0x1272
    MINOR_VERSION = 0x1923
    UPDATE_VERSION = 0x2F22
    TASK_NAME = 0x1276
    TASK_DEVICES = 0x230E
    PRODUCT_TYPE = 0x0631
    SAMPLE_RATE = 0x1344
    SAMPLE_MODE = 0x1300
    CHANNELS_TO_READ = 0x1823
    AVAILABLE_SAMPLES = 0x1223
    DEFAULT_SAMPLES = 0x31E8
    CHANNEL_TYPE = 0x187F
    MEASUREMENT = 0x0695


ANALOG_INPUT, VOLTAGE, CONTINUOUS = 10100, 10322, 10123
DEFAULT_TERMINALS, RSE, NRSE, DIFFERENTIAL = -1, 10083, 10078, 10106


class Status(IntEnum):
    """Error numbers of NI-DAQmx."""

    TASK_UNKNOWN = -200088
    CHANNEL_UNKNOWN = -200170
    ATTRIBUTE_UNKNOWN = -200197
    DEVICE_UNKNOWN = -200220
    OVERRUN = -200279
    NOT_YET_AVAILABLE = -200284
    RESERVED = -50103


TEXTS = {
    Status.TASK_UNKNOWN: "Task specified is invalid or does not exist.",
    Status.CHANNEL_UNKNOWN: "Physical channel specified does not exist on this device.",
    Status.ATTRIBUTE_UNKNOWN: "Specified property is not supported by the device or is not applicable to the task.",
    Status.DEVICE_UNKNOWN: "Device identifier is invalid.",
    Status.OVERRUN: "The application is not able to keep up with the hardware acquisition.",
    Status.NOT_YET_AVAILABLE: "Some or all of the samples requested have not yet been acquired.",
    Status.RESERVED: "The specified resource is reserved. The operation could not be completed as specified.",
}

#: Trailing metadata of a reply: the error number, and how many samples of each channel were read.
ERROR_KEY, SAMPLES_KEY = "ni-error", "ni-samps-per-chan-read"

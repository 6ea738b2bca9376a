"""NI's gRPC device server with the analog inputs of one device: the service nidaqmx_grpc.NiDAQmx by its bytes.

The messages are built and read by their published numbers, without the stubs of nidaqmx. An error of the driver
software is a failed call with the status UNKNOWN, whose trailing metadata has the error number.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from instruments.bench_config import part_of
from instruments.protocols.analog_settings import NidaqSettings
from instruments.protocols.nidaqmx import protobuf, service
from instruments.protocols.nidaqmx.protobuf import Fields
from instruments.protocols.nidaqmx.rpc_status import RpcStatus
from instruments.protocols.nidaqmx.service import TEXTS, Attribute, Behaviour, Status
from instruments.simulators.links.rpc_blocks import Call, Reply
from instruments.simulators.links.rpc_device import RpcDevice
from instruments.simulators.physics.world import SimulatedGyro
from instruments.simulators.setup import InstrumentSetup

#: Time base of the device, Hz: a sample rate is this over a whole number.
TIMEBASE_HZ = 100e6
#: Codes of the converter over its whole range.
CODES = 65536
#: Number of samples in a request for all that are available.
ALL_AVAILABLE = -1


class DaqFailure(Exception):
    """A request that the driver software refuses."""

    def __init__(self, status: Status) -> None:
        super().__init__(TEXTS[status])
        self.status = status


class Inputs:
    """The analog inputs: the gyro of the simulated world at those of the bench file, 0 V at the others.

    `volts` holds the constant voltage of inputs that a test sets; `rate_hz` is the rate that the device sets instead of
    the requested one (None: the nearest that its clock allows), and `clock_ppm` the error of its clock.
    """

    def __init__(self, settings: NidaqSettings, unit: SimulatedGyro) -> None:
        self.device, self.product = settings.device, "USB-6341"
        self.numbers = range(16)
        self.volts: dict[int, float] = {}
        self.rate_hz: float | None = None
        self.clock_ppm = unit.truth.sample_clock_ppm
        self._options, self._unit = settings.options, unit

    def coerced_hz(self, rate_hz: float) -> float:
        """Return the rate that the device sets, in scans per second by its own clock."""
        return self.rate_hz or TIMEBASE_HZ / round(TIMEBASE_HZ / rate_hz)

    def sample(self, numbers: list[int], range_v: float, t_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the volts (inputs, n) of inputs at rising times (n,) s, in steps of the converter."""
        options, sample = self._options, self._unit.sample(t_s)
        volts = np.zeros((len(numbers), len(t_s)))
        rates_v = options.rest_v + options.v_per_dps * sample.rate_dps
        for row, number in enumerate(numbers):
            if number in self.volts:
                volts[row] = self.volts[number]
            elif number in options.inputs:
                volts[row] = rates_v[:, options.inputs.index(number)]
            elif number == options.thermometer_input:
                warm_c = sample.temperature_c[:, 0] - options.thermometer_zero_c
                volts[row] = warm_c / options.thermometer_c_per_v
        step_v = 2 * range_v / CODES
        return np.clip(np.rint(volts / step_v) * step_v, -range_v, range_v)


@dataclass
class Task:
    """One task. A scan has one sample of each channel."""

    inputs: Inputs
    numbers: list[int] = field(default_factory=list)  #: of the inputs, in the order of the channels
    range_v: float = 10.0
    rate_hz: float = 1000.0
    buffer: int = 1000  #: scans
    started_s: float | None = None
    taken: int = 0  #: scans that were read

    @property
    def channels(self) -> str:
        """Names of the channels, as one text."""
        return ", ".join(f"{self.inputs.device}/ai{number}" for number in self.numbers)

    def add(self, physical: str, range_v: float) -> None:
        """Add a channel; raises DaqFailure for one that the device does not have."""
        device, _, name = physical.partition("/ai")
        if device != self.inputs.device:
            raise DaqFailure(Status.DEVICE_UNKNOWN)
        if not name.isdecimal() or int(name) not in self.inputs.numbers:
            raise DaqFailure(Status.CHANNEL_UNKNOWN)
        self.numbers.append(int(name))
        self.range_v = range_v

    def start(self, t_s: float) -> None:
        """Begin to scan."""
        self.started_s, self.taken = t_s, 0

    def available(self, t_s: float) -> int:
        """Return the number of scans until `t_s` that were not read, with those that were lost in the buffer."""
        if self.started_s is None:
            return 0
        return int(np.floor((t_s - self.started_s) * self._true_hz + 1e-6)) - self.taken

    def read(self, count: int, t_s: float) -> tuple[Status | None, NDArray[np.float64]]:
        """Return the next scans as volts (channels, n), with a status where there are fewer; raises DaqFailure."""
        available = self.available(t_s)
        if self.started_s is None or available > self.buffer:
            raise DaqFailure(Status.OVERRUN if available else Status.NOT_YET_AVAILABLE)
        samples = available if count == ALL_AVAILABLE else min(count, available)
        index = self.taken + 1 + np.arange(samples)
        self.taken += samples
        volts = self.inputs.sample(self.numbers, self.range_v, self.started_s + index / self._true_hz)
        return (Status.NOT_YET_AVAILABLE if samples < count else None), volts

    @property
    def _true_hz(self) -> float:
        return self.rate_hz * (1.0 + 1e-6 * self.inputs.clock_ppm)


class SimulatedNidaq(RpcDevice):
    """The server; `version`, `inputs` and `failure` may be set, to simulate another server.

    A task has the name that its client gives it and stays until it is cleared, also after its client has gone.
    """

    def __init__(self, setup: InstrumentSetup) -> None:
        super().__init__(setup.faults)
        self.version: tuple[int, int, int] = (26, 0, 0)  #: of the driver software
        self.inputs = Inputs(part_of(setup.gyro, NidaqSettings), setup.unit)
        self.failure: Status | None = None  #: that every read returns
        self.tasks: dict[str, Task] = {}
        self._made = 0
        self._methods: dict[str, Callable[[Fields, float], Reply]] = {
            "CreateTask": self._create,
            "ClearTask": self._clear,
            "CreateAIVoltageChan": self._add_channel,
            "CfgSampClkTiming": self._set_clock,
            "StartTask": self._start,
            "StopTask": self._stop,
            "ReadAnalogF64": self._read,
            "GetErrorString": self._error_text,
        }

    def answer(self, call: Call, t_s: float) -> Reply:
        """Return the reply to a call; one of another service or method is not implemented."""
        name, _, method = call.path.removeprefix("/").partition("/")
        try:
            fields = Fields(call.message)
            if name == service.SERVICE and method in service.ATTRIBUTE:
                return self._attribute(method, fields, t_s)
            if name != service.SERVICE or method not in self._methods:
                return Reply(None, RpcStatus.UNIMPLEMENTED)
            return self._methods[method](fields, t_s)
        except DaqFailure as failure:
            return _failed(failure.status)
        except ValueError as error:  # no message
            return Reply(None, RpcStatus.INTERNAL, str(error))

    def _create(self, fields: Fields, _t_s: float) -> Reply:
        name, behaviour = fields.text(service.CreateTask.NAME), fields.integer(service.CreateTask.BEHAVIOUR)
        if name in self.tasks and behaviour == Behaviour.INITIALIZE:
            return Reply(None, RpcStatus.ALREADY_EXISTS, f"Cannot initialize '{name}' when a session already exists.")
        if name not in self.tasks and behaviour == Behaviour.ATTACH:
            text = f"Cannot attach to '{name}' because a session has not been initialized."
            return Reply(None, RpcStatus.FAILED_PRECONDITION, text)
        is_new = name not in self.tasks
        if not name:
            self._made += 1
            name = f"session{self._made}"
        self.tasks.setdefault(name, Task(self.inputs))
        task = protobuf.message(service.CreateTask.REPLY_TASK, protobuf.text(service.TASK_NAME, name))
        return Reply(task + protobuf.integer(service.CreateTask.REPLY_IS_NEW, is_new))

    def _clear(self, fields: Fields, _t_s: float) -> Reply:
        self._task(fields)
        del self.tasks[self._name(fields)]
        return Reply(b"")

    def _add_channel(self, fields: Fields, _t_s: float) -> Reply:
        channel = service.VoltageChannel
        range_v = max(abs(fields.double(channel.MIN_V)), abs(fields.double(channel.MAX_V)))
        self._task(fields).add(fields.text(channel.PHYSICAL), range_v)
        return Reply(b"")

    def _set_clock(self, fields: Fields, _t_s: float) -> Reply:
        task = self._task(fields)
        task.rate_hz = self.inputs.coerced_hz(fields.double(service.SampleClock.RATE_HZ))
        task.buffer = fields.integer(service.SampleClock.SAMPLES)
        return Reply(b"")

    def _start(self, fields: Fields, t_s: float) -> Reply:
        task = self._task(fields)
        if any(other.started_s is not None for other in self.tasks.values()):
            raise DaqFailure(Status.RESERVED)
        task.start(t_s)
        return Reply(b"")

    def _stop(self, fields: Fields, _t_s: float) -> Reply:
        self._task(fields).started_s = None
        return Reply(b"")

    def _read(self, fields: Fields, t_s: float) -> Reply:
        try:
            if self.failure is not None:
                raise DaqFailure(self.failure)
            status, volts = self._task(fields).read(fields.integer(service.ReadAnalog.SAMPLES), t_s)
        except DaqFailure as failure:
            return _failed(failure.status, ((service.SAMPLES_KEY, "0"),))
        values, count = volts.ravel(), volts.shape[1]
        size = fields.integer(service.ReadAnalog.ARRAY_SIZE)
        if len(values) > size:
            return Reply(None, RpcStatus.INVALID_ARGUMENT, "The array is too small for the samples.")
        array = np.zeros(size)  # the server sends the whole array, filled or not
        array[: len(values)] = values
        message = (
            protobuf.integer(service.STATUS, status or 0)
            + protobuf.doubles(service.ReadAnalog.REPLY_ARRAY, array)
            + protobuf.integer(service.ReadAnalog.REPLY_SAMPLES, count)
        )
        return Reply(message, metadata=((service.SAMPLES_KEY, str(count)),))

    def _error_text(self, fields: Fields, _t_s: float) -> Reply:
        texts = {int(status): text for status, text in service.TEXTS.items()}
        return Reply(protobuf.text(service.VALUE, texts.get(fields.integer(1), "")))

    def _attribute(self, method: str, fields: Fields, t_s: float) -> Reply:
        number = fields.integer(service.ATTRIBUTE[method])
        if method == "GetSystemInfoAttributeUInt32":
            numbers = (Attribute.MAJOR_VERSION, Attribute.MINOR_VERSION, Attribute.UPDATE_VERSION)
            values: dict[int, int | float | str] = dict(zip(map(int, numbers), self.version, strict=True))
        elif method == "GetDeviceAttributeString":
            if fields.text(1) != self.inputs.device:
                raise DaqFailure(Status.DEVICE_UNKNOWN)
            values = {Attribute.PRODUCT_TYPE: self.inputs.product}
        else:
            values = self._of_task(self._task(fields), self._name(fields), t_s)
        if number not in values or (number == Attribute.DEFAULT_SAMPLES and self.version < (24, 5, 0)):
            raise DaqFailure(Status.ATTRIBUTE_UNKNOWN)
        value = values[number]
        if isinstance(value, str):
            return Reply(protobuf.text(service.VALUE, value))
        if isinstance(value, float):
            return Reply(protobuf.double(service.VALUE, value))
        return Reply(protobuf.integer(service.RAW_VALUE if method in service.ENUMERATED else service.VALUE, value))

    def _of_task(self, task: Task, name: str, t_s: float) -> dict[int, int | float | str]:
        """Return every attribute of a task and of its channels, by number."""
        return {
            Attribute.TASK_NAME: name,
            Attribute.TASK_DEVICES: self.inputs.device,
            Attribute.CHANNELS_TO_READ: task.channels,
            Attribute.SAMPLE_RATE: task.rate_hz,
            Attribute.SAMPLE_MODE: service.CONTINUOUS,
            Attribute.AVAILABLE_SAMPLES: task.available(t_s),
            Attribute.DEFAULT_SAMPLES: task.available(t_s),
            Attribute.CHANNEL_TYPE: service.ANALOG_INPUT,
            Attribute.MEASUREMENT: service.VOLTAGE,
        }

    @staticmethod
    def _name(fields: Fields) -> str:
        return fields.message(service.TASK).text(service.TASK_NAME)

    def _task(self, fields: Fields) -> Task:
        """Return the task of a request; raises DaqFailure where there is none."""
        if (task := self.tasks.get(self._name(fields))) is None:
            raise DaqFailure(Status.TASK_UNKNOWN)
        return task


def _failed(status: Status, metadata: tuple[tuple[str, str], ...] = ()) -> Reply:
    """Return an error of the driver software as the server gives it."""
    text = f"{service.TEXTS[status]}\n\nStatus Code: {status.value}"
    return Reply(None, RpcStatus.UNKNOWN, text, (*metadata, (service.ERROR_KEY, str(status.value))))

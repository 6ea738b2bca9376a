"""NI's gRPC device server with one device, as far as its analog inputs: the service nidaqmx_grpc.NiDAQmx by its bytes.

The messages are built and read by their published numbers, without the stubs of nidaqmx. An error of the driver
software is a failed call with the status UNKNOWN, whose trailing metadata has the error number.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from instruments.bench_config import part_of
from instruments.protocols.analog_settings import NidaqSettings
from instruments.protocols.nidaqmx import protobuf, service
from instruments.protocols.nidaqmx.protobuf import Fields
from instruments.protocols.nidaqmx.rpc_status import RpcStatus
from instruments.protocols.nidaqmx.service import Attribute, Behaviour, Status
from instruments.simulators.devices.nidaq.task import DaqFailure, Inputs, Task
from instruments.simulators.links.rpc_blocks import Call, Reply
from instruments.simulators.links.rpc_device import RpcDevice
from instruments.simulators.setup import InstrumentSetup


class SimulatedNidaq(RpcDevice):
    """The server; `version`, `inputs` and `failure` may be set to those of another one.

    A task has the name that its client gives it and stays until it is cleared, also after its client has gone.
    """

    def __init__(self, setup: InstrumentSetup) -> None:
        super().__init__(setup.faults)
        self.version: tuple[int, int, int] = (26, 0, 0)  #: of the driver software
        self.inputs = Inputs(part_of(setup.gyro, NidaqSettings), setup.unit)
        self.failure: Status | None = None  #: of every read
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
        if (found := self.tasks.get(self._name(fields))) is None:
            raise DaqFailure(Status.TASK_UNKNOWN)
        return found


def _failed(status: Status, metadata: tuple[tuple[str, str], ...] = ()) -> Reply:
    """Return an error of the driver software as the server gives it."""
    text = f"{service.TEXTS[status]}\n\nStatus Code: {status.value}"
    return Reply(None, RpcStatus.UNKNOWN, text, (*metadata, (service.ERROR_KEY, str(status.value))))

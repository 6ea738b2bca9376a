"""Messages of NI-DAQmx against the stubs of nidaqmx: fields by number, integers, doubles, texts, arrays, attributes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from nidaqmx import constants, error_codes
from nidaqmx._stubs import nidaqmx_pb2

from instruments.protocols.nidaqmx import protobuf, service
from instruments.protocols.nidaqmx.protobuf import Fields

INT32 = st.integers(-(2**31), 2**31 - 1)


def number(message: str, field: str) -> int:
    return getattr(nidaqmx_pb2, message).DESCRIPTOR.fields_by_name[field].number


@pytest.mark.parametrize(
    ("message", "field", "expected"),
    [
        ("CreateTaskRequest", "session_name", service.CreateTask.NAME),
        ("CreateTaskRequest", "initialization_behavior", service.CreateTask.BEHAVIOUR),
        ("CreateTaskResponse", "task", service.CreateTask.REPLY_TASK),
        ("CreateTaskResponse", "new_session_initialized", service.CreateTask.REPLY_IS_NEW),
        ("CreateAIVoltageChanRequest", "physical_channel", service.VoltageChannel.PHYSICAL),
        ("CreateAIVoltageChanRequest", "terminal_config_raw", service.VoltageChannel.TERMINALS),
        ("CreateAIVoltageChanRequest", "min_val", service.VoltageChannel.MIN_V),
        ("CreateAIVoltageChanRequest", "max_val", service.VoltageChannel.MAX_V),
        ("CfgSampClkTimingRequest", "rate", service.SampleClock.RATE_HZ),
        ("CfgSampClkTimingRequest", "sample_mode_raw", service.SampleClock.MODE),
        ("CfgSampClkTimingRequest", "samps_per_chan", service.SampleClock.SAMPLES),
        ("ReadAnalogF64Request", "num_samps_per_chan", service.ReadAnalog.SAMPLES),
        ("ReadAnalogF64Request", "array_size_in_samps", service.ReadAnalog.ARRAY_SIZE),
        ("ReadAnalogF64Response", "read_array", service.ReadAnalog.REPLY_ARRAY),
        ("ReadAnalogF64Response", "samps_per_chan_read", service.ReadAnalog.REPLY_SAMPLES),
        ("GetErrorStringResponse", "error_string", service.VALUE),
        *((f"{each}Request", "attribute_raw", at) for each, at in service.ATTRIBUTE.items()),
        *((f"{each}Response", "value", service.VALUE) for each in service.ATTRIBUTE),
        *((f"{each}Response", "value_raw", service.RAW_VALUE) for each in sorted(service.ENUMERATED)),
        *((f"{each}Request", "task", service.TASK) for each in ("StartTask", "ReadAnalogF64", "CfgSampClkTiming")),
        *((f"{each}Response", "status", service.STATUS) for each in ("StartTask", "ReadAnalogF64", "ClearTask")),
    ],
)
def test_fields_have_the_numbers_of_the_stubs(message: str, field: str, expected: int) -> None:
    assert number(message, field) == expected


@given(INT32, st.floats(allow_nan=False), st.text(max_size=300))
def test_a_request_of_the_stubs_is_read(samples: int, timeout_s: float, name: str) -> None:
    made = nidaqmx_pb2.ReadAnalogF64Request(num_samps_per_chan=samples, timeout=timeout_s, fill_mode_raw=0)
    made.task.name = name
    found = Fields(made.SerializeToString())
    assert found.message(service.TASK).text(service.TASK_NAME) == name
    assert (found.integer(service.ReadAnalog.SAMPLES), found.double(3)) == (samples, timeout_s)


@given(INT32, st.lists(st.floats(width=64, allow_nan=False), max_size=40), st.integers(0, 2**31 - 1))
def test_a_reply_is_read_by_the_stubs(status: int, values: list[float], count: int) -> None:
    array = np.array(values, dtype=np.float64)
    reply: Any = nidaqmx_pb2.ReadAnalogF64Response.FromString(
        protobuf.integer(service.STATUS, status)
        + protobuf.doubles(service.ReadAnalog.REPLY_ARRAY, array)
        + protobuf.integer(service.ReadAnalog.REPLY_SAMPLES, count)
    )
    assert (reply.status, list(reply.read_array), reply.samps_per_chan_read) == (status, values, count)
    assert Fields(reply.SerializeToString()).doubles(service.ReadAnalog.REPLY_ARRAY).tolist() == values


def test_a_golden_message() -> None:
    """The example of the encoding guide of protocol buffers (150 in field 1, "testing" in field 2), and -2 in 3."""
    message = bytes.fromhex("089601 120774657374696e67 18feffffffffffffffff01")
    found = Fields(message)
    assert (found.integer(1), found.text(2), found.integer(3)) == (150, "testing", -2)
    assert protobuf.integer(1, 150) + protobuf.text(2, "testing") + protobuf.integer(3, -2) == message


@pytest.mark.parametrize("wrong", ["08", "0880", "1207746573", "0b", "08" + "ff" * 11])
def test_bytes_that_are_no_message(wrong: str) -> None:
    with pytest.raises(ValueError, match=r"field \d has|has no end"):
        Fields(bytes.fromhex(wrong))


def test_numbers_that_nidaqmx_knows() -> None:
    assert {error_codes.DAQmxErrors(status).value for status in service.Status} == set(service.Status)
    assert service.Status.OVERRUN == error_codes.DAQmxErrors.SAMPLES_NO_LONGER_AVAILABLE
    assert constants.AcquisitionType.CONTINUOUS.value == service.CONTINUOUS
    assert constants.ChannelType.ANALOG_INPUT.value == service.ANALOG_INPUT
    assert constants.UsageTypeAI.VOLTAGE.value == service.VOLTAGE

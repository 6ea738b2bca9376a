"""Which links an address leads to."""

from __future__ import annotations

import errno
from typing import Any

import pytest
import serial

from instruments.bench_config import read_bench
from instruments.clock import ScaledClock, VirtualClock
from instruments.errors import LinkError
from instruments.simulation import open_simulation, simulated_links
from instruments.transport.factory import Ports


@pytest.mark.parametrize(
    "opener",
    [
        lambda ports: ports.serial("sim://arrick", device="table", baudrate=9600, timeout_s=1.0),
        lambda ports: ports.modbus_tcp("sim://watlow-f4t", 502, device="table", timeout_s=1.0),
        lambda ports: ports.modbus_rtu("sim://watlow-f4", device="table", baudrate=9600, timeout_s=1.0),
        lambda ports: ports.port_timeout_s("sim://arrick", 1.0, device="table"),
    ],
)
def test_a_simulated_address_needs_a_simulation(opener: Any) -> None:
    with pytest.raises(
        LinkError,
        match=r"table: sim://.* is the address of a simulated instrument, but this bench is not "
        r"simulated; correct the address",
    ):
        opener(Ports(VirtualClock()))


def test_a_port_that_is_not_there_is_named_with_its_remedy() -> None:
    with pytest.raises(LinkError, match=r"table: port /dev/no-such-port cannot be opened .*check the cable"):
        Ports(VirtualClock()).serial("/dev/no-such-port", device="table", baudrate=9600, timeout_s=1.0)


def test_a_time_out_of_the_bench_clock_is_wall_time_on_hardware_and_itself_in_simulation() -> None:
    clock = ScaledClock(10.0)
    simulation = open_simulation(read_bench("single-axis-sim"), clock)
    ports = Ports(clock, simulated_links(simulation, clock))
    assert ports.port_timeout_s("/dev/ttyUSB0", 2.0, device="table") == pytest.approx(0.2)
    assert ports.port_timeout_s("sim://arrick", 2.0, device="table") == 2.0


@pytest.mark.parametrize(
    ("number", "says"),
    [
        (
            errno.EACCES,
            r"check that this user has access to the port: run `sudo usermod -aG dialout \$USER`, then log in again$",
        ),
        (errno.EBUSY, r"check which other process has it open: run `fuser -v /dev/ttyUSB0`, and end that process$"),
        (errno.EAGAIN, r"check which other process has it open: run `fuser -v /dev/ttyUSB0`, and end that process$"),
        (errno.ENOENT, r"check the cable and the port's name; "),
        (errno.EIO, r"check the cable, the name of the port, and which other process uses the port$"),
    ],
)
def test_a_port_that_cannot_be_opened_is_named_with_the_command_that_corrects_it(
    monkeypatch: pytest.MonkeyPatch, number: int, says: str
) -> None:
    def refuse(*_: Any, **__: Any) -> Any:
        raise serial.SerialException(number, "could not open port")

    monkeypatch.setattr("instruments.transport.opened_port.unopened", refuse)
    with pytest.raises(LinkError, match=rf"mems: port /dev/ttyUSB0 cannot be opened \(.*\); {says}") as told:
        Ports(VirtualClock()).serial("/dev/ttyUSB0", device="mems", baudrate=9600, timeout_s=1.0)
    assert "\n" not in str(told.value)

"""Analog gyros through the package uldaq itself, on a stand-in of its C library that is compiled here; no hardware."""

from __future__ import annotations

import ctypes
import ctypes.util
import importlib
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from instruments.bench import open_bench
from instruments.bench_config import BenchFile, read_bench
from instruments.clock import VirtualClock
from instruments.errors import InstrumentError, LimitError, LinkError, NoReply, WrongInstrument
from instruments.protocols.uldaq_library import (
    BIPOLAR_RANGES,
    CONTINUOUS,
    SCALED,
    InputMode,
    Interface,
    ScanStatus,
    UlError,
)

SOURCE = Path(__file__).parents[2] / "helpers" / "libuldaq_stand_in.c"
FLAGS = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-O1", "-shared", "-fPIC", "-Wl,-soname,libuldaq.so"]
LOW, INPUTS, SAMPLES, RANGE, MODE, RUNNING = range(6)
DEAD, PERMISSION, OVERRUN = 8, 4, 18

pytestmark = pytest.mark.needs_cc


def bench_with(**gyro: Any) -> BenchFile:
    record = read_bench("single-axis-sim").model_dump()
    kept = {"name": "fog", "driver": "mcc-daq", "serial": "A1", "max_rate_dps": 90, "sample_rate_hz": 100}
    return BenchFile.model_validate(record | {"gyros": [kept | gyro]})


class PassingClock(VirtualClock):
    """A virtual clock that passes its time to the stand-in, which has none."""

    def __init__(self, library: Any) -> None:
        super().__init__()
        self._library = library

    def sleep(self, duration_s: float) -> None:
        super().sleep(duration_s)
        self._library.stand_in_pass(ctypes.c_double(duration_s))


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """Compile the stand-in, and import uldaq on it: a library that is loaded is found by its name."""
    compiler = shutil.which("cc")
    assert compiler is not None
    made = tmp_path_factory.mktemp("libuldaq") / "libuldaq.so"
    subprocess.run([compiler, *FLAGS, str(SOURCE), "-o", str(made)], check=True, capture_output=True)
    loaded = ctypes.CDLL(str(made))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ctypes.util, "find_library", lambda _name: None)  # also where the maker's is installed
        importlib.import_module("uldaq")
        yield loaded
    for name in [name for name in sys.modules if name.partition(".")[0] == "uldaq"]:
        del sys.modules[name]


@pytest.fixture
def daq(library: Any) -> Iterator[Callable[..., Any]]:
    """Open a bench with a gyro on the stand-in; returns driver, clock and the stand-in's settings."""
    opened: list[Any] = []

    def make(devices: int = 1, **gyro: Any) -> Any:
        library.stand_in_reset(devices)
        clock = PassingClock(library)
        opened.append(open_bench(bench_with(**gyro), clock))
        return opened[-1].gyros["fog"], clock

    yield make
    for bench in opened:
        bench.close()
    assert library.stand_in_handles() == 0  # every device was released


def test_what_the_library_is_asked_for(daq: Callable[..., Any], library: Any) -> None:
    gyro, _ = daq(options={"inputs": [5], "thermometer_input": 3, "differential": True, "range_v": 2.0})
    gyro.start()
    asked = [library.stand_in_setting(which) for which in (LOW, INPUTS, SAMPLES, RANGE, MODE, RUNNING)]
    assert asked == [3, 3, 3000, 9, 1, 1]  # inputs 3 to 5, 30 s, 2 V, differential
    readings = gyro.read(0.1)
    rate, warm = gyro.channels
    volts = 0.001 * np.arange(10)
    assert rate.value(readings.raw["gyro_z"]) == pytest.approx(0.5 + volts, abs=1e-7)
    assert warm.value(readings.raw["temperature_c"]) == pytest.approx(20.0 * (0.3 + volts) - 25.0, abs=1e-5)
    gyro.stop()
    assert library.stand_in_setting(RUNNING) == 0


def test_every_scan_is_in_a_reading_with_the_time_of_its_number(daq: Callable[..., Any]) -> None:
    gyro, clock = daq(options={"average": 10})
    assert gyro.identify().reported == {"inputs": "USB-1608G 01E3A2B0"}
    gyro.start()
    parts = [gyro.read(7.0) for _ in range(10)]  # the buffer of 30 s is filled more than twice
    assert [part.lost for part in parts] == [0] * 10
    device_s = np.concatenate([part.device_s for part in parts])
    assert device_s == pytest.approx((np.arange(len(device_s)) * 10 + 9) / 100)
    assert len(device_s) == 700
    volts = gyro.channels[0].value(np.concatenate([part.raw["gyro_z"] for part in parts]))
    first = np.arange(700) * 10 % 1000
    assert volts == pytest.approx(0.001 * (first + 4.5), abs=1e-7)
    times, arrival_s = (np.concatenate([getattr(part, name) for part in parts]) for name in ("t_s", "arrival_s"))
    assert np.diff(times) == pytest.approx(0.1, abs=0.011)
    assert (arrival_s >= times - 1e-9).all()
    assert clock.now_s() == pytest.approx(arrival_s[-1])


def test_scans_that_were_overwritten_are_lost_by_their_number(daq: Callable[..., Any]) -> None:
    gyro, clock = daq(options={"average": 10})
    gyro.start()
    before = gyro.read(10.0)
    clock.sleep(65.0)
    after = gyro.read(5.0)  # 8000 scans were made, 1000 were read; the buffer has the last 2900 for sure
    assert (len(before), before.lost) == (100, 0)
    assert (len(after), after.lost) == (290, 410)
    assert after.device_s[0] == pytest.approx((8000 - 2900 + 9) / 100)
    volts = gyro.channels[0].value(after.raw["gyro_z"])
    assert volts == pytest.approx(0.001 * (np.arange(5100, 8000, 10) % 1000 + 4.5), abs=1e-7)


@pytest.mark.parametrize(
    ("error", "text"),
    [
        (
            OVERRUN,
            r"cannot read the scans of the USB device \(error 18: FIFO overrun, .*\); check whether a lower",
        ),
        (
            DEAD,
            r"cannot read the scans of the USB device \(error 8: Device no longer responding\); check device, cable",
        ),
        (0, "the USB device has ended its scans after 100 of them; check that no other program uses"),
    ],
)
def test_a_scan_that_ended(daq: Callable[..., Any], library: Any, error: int, text: str) -> None:
    """After a full memory of the device, or after it was unplugged, how many scans are missing is not known."""
    gyro, _ = daq()
    gyro.start()
    gyro.read(1.0)
    library.stand_in_fail(error)
    with pytest.raises(LinkError, match=rf"^fog: {text}"):
        gyro.read(1.0)
    assert library.stand_in_handles() == 0
    with pytest.raises(LinkError, match="were not started; start them first"):
        gyro.read(0.1)
    gyro.start()
    assert len(gyro.read_latest()) == 1


def test_a_device_whose_clock_has_stopped(daq: Callable[..., Any], library: Any) -> None:
    gyro, clock = daq()
    gyro.start()
    clock._library = type("NoTime", (), {"stand_in_pass": lambda _self, _s: None})()
    with pytest.raises(NoReply, match="no scan from the USB device for 2 s; check cable and power"):
        gyro.read(3.0)


def test_volts_at_the_ends_of_the_range_are_not_valid(daq: Callable[..., Any], library: Any) -> None:
    gyro, _ = daq()
    gyro.start()
    for volts, valid in ((9.8, True), (-9.8, True), (9.95, False), (-10.0, False)):
        library.stand_in_volts(ctypes.c_double(volts))
        assert set(gyro.read(0.1).valid) == {valid}, volts


@pytest.mark.parametrize(
    ("devices", "given", "kind", "text"),
    [
        (0, {}, LinkError, r"no USB device of Measurement Computing is connected \(found: none\); check cable"),
        (2, {}, LinkError, r"2 USB devices fit \(USB-1608G 01E3A2B0, USB-1608G 01E3A2B1\); give the unique ID of one"),
        (1, {"device": "X9"}, LinkError, r"no USB device X9 is connected \(found: USB-1608G 01E3A2B0\)"),
        (1, {"host": "10.0.0.8"}, LinkError, r"cannot start the scans of 10.0.0.8 \(error 95: Invalid host\)"),
        (1, {"options": {"inputs": [16]}}, LimitError, "input 16 is not one of the 16 single-ended inputs of USB-16"),
        (1, {"options": {"inputs": [8], "differential": True}}, LimitError, "input 8 is not one of the 8 differenti"),
        (1, {"options": {"range_v": 4.0}}, LimitError, r"range_v 4 V is not a range .* choose one of 1, 2, 5, 10 as"),
        (1, {"options": {"range_v": 7.0}}, LimitError, r"range_v 7 V is not a range of the single-ended inputs of USB"),
    ],
)
def test_what_is_not_there(
    daq: Callable[..., Any], devices: int, given: dict[str, Any], kind: type[InstrumentError], text: str
) -> None:
    gyro, _ = daq(devices, **given)
    with pytest.raises(kind, match=f"^fog: {text}"):
        gyro.start()
    gyro.stop()
    gyro.stop()


def test_devices_by_name_and_by_host(daq: Callable[..., Any]) -> None:
    for given, found in (
        ({"device": "01E3A2B1"}, "USB-1608G 01E3A2B1"),
        ({"host": "10.0.0.9"}, "E-1608 01E3A2B0"),
    ):
        gyro, _ = daq(3, **given)
        assert gyro.identify().reported == {"inputs": found}


def test_a_device_that_may_not_be_used(daq: Callable[..., Any], library: Any) -> None:
    gyro, _ = daq()
    library.stand_in_connect_error(PERMISSION)
    with pytest.raises(
        LinkError, match=r"\(error 4: Insufficient permission .*\); check that the maker's udev rules are"
    ):
        gyro.start()


@pytest.mark.parametrize(("has", "text"), [((0, 1), "has no analog inputs"), ((1, 0), "has no clock of its own")])
def test_a_device_that_cannot_scan(daq: Callable[..., Any], library: Any, has: tuple[int, int], text: str) -> None:
    gyro, _ = daq()
    library.stand_in_inputs(*has)
    with pytest.raises(WrongInstrument, match=f"^fog: USB-1608G 01E3A2B0 {text}"):
        gyro.start()


def test_another_rate(daq: Callable[..., Any], library: Any) -> None:
    gyro, _ = daq()
    library.stand_in_rate(ctypes.c_double(0.9))
    with pytest.raises(WrongInstrument, match="scans 90 times per second, but the bench file states 100; set sample"):
        gyro.start()
    assert library.stand_in_setting(RUNNING) == 0


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # of uldaq's own half-made object
def test_a_descriptor_that_the_library_refuses(
    daq: Callable[..., Any], library: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    gyro, _ = daq()
    uldaq = sys.modules["uldaq"]
    found = uldaq.get_daq_device_inventory(uldaq.InterfaceType.USB)
    monkeypatch.setattr(uldaq, "get_daq_device_inventory", lambda _interface: found)
    library.stand_in_reset(-1)
    with pytest.raises(LinkError, match=r"\(error 100001: Invalid descriptor\); check device, cable and power"):
        gyro.start()


@pytest.mark.usefixtures("library")
def test_numbers_that_uldaq_knows() -> None:
    uldaq = sys.modules["uldaq"]
    for own, theirs in ((UlError, uldaq.ULError), (InputMode, uldaq.AiInputMode), (ScanStatus, uldaq.ScanStatus)):
        assert {each.name: each.value for each in own} == {each.name: theirs[each.name].value for each in own}
    assert (uldaq.ScanOption.CONTINUOUS, uldaq.AInScanFlag.DEFAULT) == (CONTINUOUS, SCALED)
    assert uldaq.InterfaceType.USB == Interface.USB
    named = {}
    for each in uldaq.Range:
        if (found := re.fullmatch(r"BIP(\d*)(?:PT(\d+))?VOLTS", each.name)) is not None:
            named[float(f"{found[1] or 0}.{found[2] or 0}")] = each.value
    assert named == BIPOLAR_RANGES


@pytest.mark.parametrize(
    ("missing", "text"),
    [
        ("uldaq", r"the package uldaq is not installed; run `pip install labctl\[mcc\]`"),
        (
            "library",
            r"the package uldaq cannot load the C library libuldaq .* `./configure && make && sudo make install`",
        ),
    ],
)
def test_what_is_not_installed(monkeypatch: pytest.MonkeyPatch, missing: str, text: str) -> None:
    for name in [name for name in sys.modules if name.partition(".")[0] == "uldaq"]:
        monkeypatch.delitem(sys.modules, name)
    if missing == "uldaq":
        monkeypatch.setitem(sys.modules, "uldaq", None)
    monkeypatch.setattr(ctypes.util, "find_library", lambda _name: "libuldaq-that-no-computer-has.so")
    bench = open_bench(bench_with(), VirtualClock())
    with pytest.raises(LinkError, match=f"^fog: {text}"):
        bench.gyros["fog"].start()
    bench.close()


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"host": "tcp://daq.lab"}, "is not a network address; give the name or the IP address"),
        ({"host": "daq.lab", "device": "01E3A2B0"}, "keys host and device are both given"),
        ({"port": "/dev/ttyUSB0"}, "key port is not used; give the unique ID of a USB device as device, or host"),
    ],
)
def test_settings_that_are_refused(given: dict[str, Any], text: str) -> None:
    with pytest.raises(ValidationError, match=text):
        open_bench(bench_with(**given), VirtualClock())

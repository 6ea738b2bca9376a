"""Reference thermometers and hygrometers through their bytes: golden requests, units, serial numbers, silence."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from pydantic import ValidationError

from instruments.bench import open_bench
from instruments.bench_config import BenchFile, read_bench
from instruments.checks.check import check
from instruments.clock import VirtualClock
from instruments.drivers.resolution import resolve
from instruments.errors import MalformedReply, NoReply, WrongInstrument
from tests.helpers.tap import Tap


def bench_with(*references: dict[str, Any]) -> BenchFile:
    record = read_bench("single-axis-sim").model_dump()
    record["references"] = [
        {"driver": "line-reference", "port": f"sim://line-reference/{each.get('name', 'reference')}", **each}
        for each in references
    ]
    return BenchFile.model_validate(record)


@pytest.fixture
def reference() -> Callable[..., Any]:
    """Make a bench with one reference instrument, and a tap on its wire."""

    def make(**settings: Any) -> Any:
        clock = VirtualClock()
        bench = open_bench(bench_with(settings), clock)
        simulation: Any = bench.simulation
        url = "sim://line-reference/reference"
        wire = simulation.device(url)
        driver: Any = bench.references["reference"]
        driver.tap = simulation._devices[url] = Tap(wire)
        driver.simulated, driver.faults, driver.clock = wire._device, simulation.faults(url), clock
        return driver

    return make


@pytest.mark.parametrize(
    ("settings", "requests"),
    [
        ({"model": "fluke-1529", "input": 2}, [b"*IDN?\r", b"FETC? 2\r"]),
        ({"model": "fluke-1502a"}, [b"*IDN?\r", b"T\r"]),
        ({"model": "fluke-1521"}, [b"FETCH?\r"]),
        ({"model": "omega-ithx"}, [b"*SRTC\r", b"*SRH\r"]),
        (
            {"quantities": {"reference_c": {"ask": "MEAS:TEMP?"}}, "identity": "*IDN?", "end": "\n"},
            [b"*IDN?\n", b"MEAS:TEMP?\n"],
        ),
    ],
)
def test_what_each_model_is_asked(
    reference: Callable[..., Any], settings: dict[str, Any], requests: list[bytes]
) -> None:
    driver = reference(**settings)
    driver.identify()
    assert driver.tap.heard == requests
    value = driver.channels[0].offset + driver.channels[0].scale * driver.read().raw["reference_c"]
    assert value == pytest.approx(25.0, abs=0.1)


@pytest.mark.parametrize("reply", ["t:   25.587 C", "t: 25.587 C", "t: 25.587 C 03-01-1999 15:49:15"])
def test_replies_that_manuals_print(reference: Callable[..., Any], reply: str) -> None:
    driver = reference(model="fluke-1521")
    driver.simulated.answer = lambda _request, _t_s: reply
    assert driver.read().raw == {"reference_c": 255870}


def test_another_unit_is_refused(reference: Callable[..., Any]) -> None:
    driver = reference(model="fluke-1521")
    driver.simulated.unit = "F"
    with pytest.raises(
        MalformedReply,
        match=r"^reference: answers in 'F' instead of 'C'; set the unit of measurement at the panel of the instrument$",
    ):
        driver.read()


def test_a_certificate_belongs_to_one_serial_number(reference: Callable[..., Any]) -> None:
    driver = reference(model="fluke-1529", serial="B77", certificate="NMI 4711, 2026-03-02")
    assert driver.identify() == "FLUKE,fluke-1529,B77,1.00; certificate NMI 4711, 2026-03-02"
    driver.simulated.identity = "FLUKE,1529,A08125,1.10"
    with pytest.raises(WrongInstrument, match="the bench file gives serial number 'B77'; correct the address"):
        driver.identify()


def test_the_correction_of_the_certificate_is_added_and_the_reading_kept(reference: Callable[..., Any]) -> None:
    driver = reference(model="fluke-1529", corrections={"reference_c": -0.012})
    (channel,) = driver.channels
    assert (channel.offset, channel.scale) == (-0.012, 1e-4)
    driver.simulated.answer = lambda _request, _t_s: "+2.50120000E+01"
    assert driver.read().raw == {"reference_c": 250120}
    assert channel.offset + channel.scale * 250120 == pytest.approx(25.0)


def test_silence_is_bounded_and_named(reference: Callable[..., Any]) -> None:
    driver = reference(model="fluke-1529")
    driver.faults.arm("silence")
    with pytest.raises(NoReply, match=r"^reference: no answer to the request to read by 'FETC\? 1' .*3 tries"):
        driver.read()
    assert driver.clock.now_s() < 20
    driver.faults.clear()
    driver.close()
    driver.close()
    assert driver.read().raw


@pytest.mark.parametrize(
    ("references", "text"),
    [
        ([{"model": "fluke-9999"}], "model 'fluke-9999' is not known"),
        ([{}], "give model"),
        ([{"quantities": {"reference_c": {"ask": "T", "pattern": "(.*)"}}}], "has no group"),
        ([{"model": "fluke-1529", "name": "fog"}], "two instruments have the name 'fog'"),
        (
            [
                {"model": "fluke-1529", "name": "a", "is_temperature": True},
                {"model": "fluke-1529", "name": "b", "is_temperature": True},
            ],
            "is_temperature is set for a and b",
        ),
    ],
)
def test_wrong_bench_files_are_refused(references: list[dict[str, Any]], text: str) -> None:
    with pytest.raises(ValidationError, match=text):
        resolve(bench_with(*references))


def test_bench_check_reads_it() -> None:
    found = {report.device: report for report in check(bench_with({"model": "omega-ithx"}), VirtualClock())}[
        "reference"
    ]
    assert found.is_ok
    assert [finding.what for finding in found.findings] == ["identity", "reference_c", "humidity_pct"]
    assert found.findings[0].text == "Omega iTHX"
    assert found.findings[1].value == pytest.approx(25.0, abs=0.5)

"""What every driver must do, whichever it is: the protocols of table, chamber and gyro, and how they fail."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from instruments.bench_config import read_bench, shipped_benches
from instruments.drivers.driver import ChamberDriver, GyroDriver, TableDriver
from instruments.drivers.registry import names_of
from instruments.errors import InstrumentError, LimitError, LinkError
from instruments.interfaces.chamber import Chamber
from instruments.interfaces.gyro import Gyro
from instruments.interfaces.table import RateTable

Make = Callable[..., Any]
PROTOCOLS: dict[str, type] = {"table": RateTable, "chamber": Chamber, "gyro": Gyro}
GYROS = names_of(GyroDriver)
DRIVERS = [
    *(("table", name) for name in names_of(TableDriver)),
    *(("chamber", name) for name in names_of(ChamberDriver)),
    *(("gyro", name) for name in GYROS),
]
PLACES = {
    "arrick-c4": ("single-axis-sim", {}),
    "watlow-f4": ("single-axis-sim", {}),
    "watlow-f4t": ("triaxial-sim", {}),
    "kvh-rd2100": ("single-axis-sim", {}),
    "kvh-dsp3000": (
        "single-axis-sim",
        {"driver": "kvh-dsp3000", "port": "sim://kvh-dsp3000/fog", "sample_rate_hz": 100},
    ),
    "stim300": ("triaxial-sim", {}),
    "gyrostar": ("gyrostar-sim", {}),
}
#: The first word of a method's docstring says whether it asks, acts, or changes a setting.
FIRST_WORDS = ("Get", "Control", "Measure", "Set", "What")


@pytest.fixture(params=DRIVERS, ids=[driver for _, driver in DRIVERS])
def one(request: pytest.FixtureRequest, stand: Make) -> Any:
    """A driver on its bench: stand, kind, driver, url."""
    return placed(stand, *request.param)


@pytest.fixture(params=GYROS)
def gyro(request: pytest.FixtureRequest, stand: Make) -> Any:
    """A gyro driver on its bench."""
    return placed(stand, "gyro", request.param)


def placed(stand: Make, kind: str, name: str) -> Any:
    bench, changes = PLACES[name]
    s = stand(bench, **{kind: changes})
    s.kind = kind
    s.driver = {"table": s.bench.table, "chamber": s.bench.chamber, "gyro": s.gyro}[kind]
    place = {"table": s.file.table, "chamber": s.file.chamber, "gyro": s.file.gyros[0]}[kind]
    s.url = getattr(place, "port", None) or place.host
    return s


def talk(s: Any) -> None:
    """Ask something that needs an answer."""
    if s.kind == "gyro":
        s.driver.start()
        s.driver.read_latest()
    else:
        s.driver.identify()


def test_every_driver_is_on_a_shipped_bench_or_named_here() -> None:
    assert set(PLACES) == {driver for _, driver in DRIVERS}
    used = {g.driver for name in shipped_benches() for g in read_bench(name).gyros}
    assert used <= set(GYROS)


def test_every_method_of_the_protocol_is_there_and_says_what_it_does(one: Any) -> None:
    protocol, driver = PROTOCOLS[one.kind], type(one.driver)
    for name, member in inspect.getmembers(protocol):
        if name.startswith("_") or not (inspect.isfunction(member) or isinstance(member, property)):
            continue
        if isinstance(member, property) and not hasattr(driver, name):
            assert hasattr(one.driver, name)  # a plain attribute will do for what never changes
            continue
        own = getattr(driver, name)
        text = inspect.getdoc(own)
        assert text, f"{driver.__name__}.{name} has no docstring"
        assert text.split()[0] in FIRST_WORDS, f"{driver.__name__}.{name}: {text!r}"
        if inspect.isfunction(member):
            assert list(inspect.signature(own).parameters) == list(inspect.signature(member).parameters), name


def test_making_a_driver_sends_nothing(one: Any) -> None:
    assert one.clock.now_s() == 0


def test_it_says_who_it_is(one: Any) -> None:
    found = one.driver.identify()
    if one.kind == "gyro":
        assert found.serial == one.file.gyros[0].serial
        assert found.technology
    else:
        assert found


def test_silence_is_a_link_error_that_names_the_device(one: Any) -> None:
    one.faults(one.url).arm("silence")
    with pytest.raises(LinkError) as caught:
        talk(one)
    assert str(caught.value).startswith(f"{one.driver.name}: ")
    assert caught.value.device == one.driver.name
    assert one.clock.now_s() < 60, "a silent device must not hold the bench up"


def test_a_dropped_link_is_said_and_can_be_opened_again(one: Any) -> None:
    talk(one)
    # Modbus drivers open the link again by themselves; streams and the table say that it broke
    one.faults(one.url).arm("dropped_link", count=1)
    try:
        talk(one)
    except LinkError as error:
        assert error.device == one.driver.name  # noqa: PT017  either outcome is right; a wrong one is not
    talk(one)


@pytest.mark.parametrize("fault", ["split", "noise", "merge"])
def test_a_bad_wire_gives_a_right_answer_or_an_instrument_error(one: Any, fault: str) -> None:
    talk(one)
    faults = one.faults(one.url)
    for trial in range(12):
        now = one.clock.now_s()
        armed = faults.arm(fault, from_s=now, until_s=now + 0.5, count=1, value=3)
        try:
            talk(one)
        except InstrumentError as error:
            assert error.device == one.driver.name, f"trial {trial}"  # noqa: PT017  either outcome is right
        armed.count = 0
        one.clock.sleep(1.0)
    talk(one)


def test_closing_twice_does_no_harm(one: Any) -> None:
    talk(one)
    identity = one.driver.identify()
    close = one.driver.stop if one.kind == "gyro" else one.driver.close
    close()
    close()
    talk(one)
    assert one.driver.identify() == identity


def test_limits_are_refused_before_anything_moves(one: Any) -> None:
    if one.kind == "table":
        with pytest.raises(LimitError):
            one.driver.spin(one.driver.limits.max_rate_dps * 1.01, 1.0)
        assert not one.world.table.moving(one.clock.now_s())
    elif one.kind == "chamber":
        before = one.driver.read().setpoint_c
        for wrong in (one.driver.limits.max_c + 1, one.driver.limits.min_c - 1):
            with pytest.raises(LimitError):
                one.driver.set_temperature_c(wrong)
        assert one.driver.read().setpoint_c == before
    else:
        limits = one.driver.limits
        assert limits.max_rate_dps > 0
        assert limits.min_c < limits.max_c


def test_a_gyro_gives_whole_numbers_at_rising_times(gyro: Any) -> None:
    gyro.driver.start()
    parts = [gyro.driver.read(1.0) for _ in range(4)]
    times = np.concatenate([p.t_s for p in parts])
    assert np.all(np.diff(times) > 0)
    assert len(times) == pytest.approx(4 * gyro.driver.sample_rate_hz, abs=3)
    names = {channel.name for channel in gyro.driver.channels}
    for part in parts:
        assert set(part.raw) == names
        assert all(values.dtype == np.int64 for values in part.raw.values())
        assert part.valid.dtype == bool
    glanced = gyro.driver.read_latest()
    assert len(glanced) == 1
    assert gyro.clock.now_s() - glanced.t_s[0] <= 2 / gyro.driver.sample_rate_hz + 0.1

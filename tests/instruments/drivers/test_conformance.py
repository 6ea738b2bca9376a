"""What every driver must do, whichever it is: the checks of `labctl driver test`, on all of labctl's own drivers."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from instruments.bench_config import read_bench, shipped_benches
from instruments.conformance import checks_of, try_driver
from instruments.conformance.run import COMMON, OF_KIND, PROTOCOLS
from instruments.conformance.stand import Stand, open_stand, place_of
from instruments.drivers.driver import GyroDriver, Trial
from instruments.drivers.kvh import KVH_DSP3000, KvhGyro
from instruments.drivers.registry import DRIVERS, names_of
from instruments.errors import NoReply
from instruments.interfaces.gyro import Readings
from instruments.protocols.kvh_lines import KvhSettings

OWN = [name for name in DRIVERS.names if DRIVERS.plugin(name).is_own]
CHECKS = [(name, check) for name in OWN for check in checks_of(name)]
#: The summary of a docstring (PEP 257): a capital letter first, a full stop at the end.
SUMMARY = re.compile(r"[A-Z].*\.", re.DOTALL)


def test_every_driver_has_a_place() -> None:
    used = {gyro.driver for name in shipped_benches() for gyro in read_bench(name).gyros}
    assert used <= set(names_of(GyroDriver))
    assert all(place_of(name).is_simulated for name in OWN)


@pytest.mark.parametrize(("name", "check"), CHECKS, ids=[f"{name}-{check.__name__}" for name, check in CHECKS])
def test_a_driver_does_what_every_driver_must(name: str, check: Any) -> None:
    stand = open_stand(name, place_of(name))
    assert check(stand) is None  # raises what the driver does otherwise
    stand.bench.close()


@pytest.fixture(params=OWN)
def stand(request: pytest.FixtureRequest) -> Iterator[Stand]:
    opened = open_stand(request.param, place_of(request.param))
    yield opened
    opened.bench.close()


def test_every_method_says_what_it_does(stand: Stand) -> None:
    driver = type(stand.driver)
    for name, member in inspect.getmembers(PROTOCOLS[stand.kind]):
        if name.startswith("_") or not (inspect.isfunction(member) or isinstance(member, property)):
            continue
        if isinstance(member, property) and not hasattr(driver, name):
            continue  # a plain attribute will do for what never changes
        text = inspect.getdoc(getattr(driver, name))
        assert text, f"{driver.__name__}.{name} has no docstring"
        assert SUMMARY.fullmatch(text.partition("\n\n")[0].strip()), f"{driver.__name__}.{name}: {text!r}"


class Crooked(KvhGyro):
    """A driver that does some of it wrong."""

    def identify(self) -> Any:
        raise ValueError("no\nidentity")

    def read(self, duration_s: float) -> Readings:
        good = super().read(duration_s)
        return Readings(good.t_s, {name: -values for name, values in good.raw.items()}, good.valid)

    def read_latest(self, fresh: bool = True) -> Readings:
        try:
            return super().read_latest()
        except NoReply:
            return Readings(np.zeros(1), {}, np.zeros(1, dtype=bool))


def test_what_a_driver_does_wrong_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def make(*given: Any) -> Crooked:
        return Crooked(*given, model=KVH_DSP3000)

    trial = Trial(section={"port": "sim://kvh-dsp3000/fog", "sample_rate_hz": 100})
    monkeypatch.setitem(DRIVERS._loaded, "kvh-dsp3000", GyroDriver(KvhSettings, make, trial))
    found = {outcome.check: outcome.problem for outcome in try_driver("kvh-dsp3000")}
    assert found["has every method"] == "Crooked.read_latest takes ['fresh']; Gyro says []"
    assert found["says who it is"] == ("raised ValueError: no; every failure of a driver must be an InstrumentError")
    assert found["reports silence"] == "Crooked answers, but the instrument is silent; raise NoReply after a time-out"
    assert found["sees the rate of the table"].startswith("gyro_z follows a table rate of 20")
    assert found["gives whole numbers at rising times"] == ""
    assert found["sends nothing when it is made"] == ""


def test_every_check_says_what_it_checks() -> None:
    for check in (*COMMON, *(each for checks in OF_KIND.values() for each in checks)):
        assert check.__doc__

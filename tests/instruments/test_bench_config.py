"""Bench files: what cannot be a bench is refused when it is read."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import ValidationError

from instruments.bench import check_settings, open_bench
from instruments.bench_config import BenchFile, read_bench
from instruments.clock import VirtualClock
from instruments.drivers import registry
from instruments.drivers.watlow_f4 import WatlowF4


def two_units(**second: Any) -> dict[str, Any]:
    bench = read_bench("single-axis-sim").model_dump(exclude_none=True)
    (unit,) = bench["gyros"]
    other = {"name": "other", "serial": "FOG-0002", "port": "sim://other"}
    return {**bench, "gyros": [unit, {**unit, **other, **second}]}


def test_two_units_may_share_a_bench() -> None:
    assert len(BenchFile.model_validate(two_units()).gyros) == 2


@pytest.mark.parametrize("what", ["name", "serial", "port"])
def test_two_units_are_never_taken_for_one(what: str) -> None:
    same = two_units()["gyros"][0][what]
    with pytest.raises(ValidationError, match=f"two gyros have the {what} '{same}'; each needs its own"):
        BenchFile.model_validate(two_units(**{what: same}))


@pytest.mark.parametrize(
    ("device", "place", "known"),
    [
        ("table", ("table", "driver"), "'arrick-c4'"),
        ("chamber", ("chamber", "driver"), "'watlow-f4' or 'watlow-f4t'"),
        ("gyros", ("gyros", 0, "driver"), "'kvh-dsp3000', 'kvh-rd2100', 'stim300' or 'gyrostar'"),
    ],
)
def test_an_unknown_driver_is_refused_with_its_place_and_the_known_names(
    device: str, place: tuple[str | int, ...], known: str
) -> None:
    record = read_bench("single-axis-sim").model_dump()
    (record[device][0] if device == "gyros" else record[device])["driver"] = "watlow-f5"
    bench = BenchFile.model_validate(record)
    for refused in (lambda: check_settings(bench), lambda: open_bench(bench, VirtualClock())):
        with pytest.raises(ValidationError) as caught:
            refused()
        (error,) = caught.value.errors()
        assert (error["loc"], error["input"], error["msg"]) == (place, "watlow-f5", f"Input should be {known}")


def test_a_driver_of_the_registry_needs_no_other_list(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(registry.CHAMBERS, "watlow-f5", registry.CHAMBERS["watlow-f4"])
    record = read_bench("single-axis-sim").model_dump()
    record["chamber"]["driver"] = "watlow-f5"
    bench = BenchFile.model_validate(record)
    check_settings(bench)
    opened = open_bench(bench, VirtualClock())
    assert isinstance(opened.chamber, WatlowF4)
    opened.close()


def test_a_simulated_gyro_whose_driver_has_no_profile_is_told_to_name_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(registry.GYROS, "kvh-new", registry.GYROS["kvh-rd2100"])
    record = read_bench("single-axis-sim").model_dump()
    (gyro,) = record["gyros"]
    gyro |= {"driver": "kvh-new", "sample_rate_hz": None}
    with pytest.raises(ValueError, match="gyro driver 'kvh-new': no profile of a simulated unit is known"):
        open_bench(BenchFile.model_validate(record), VirtualClock())
    record["simulation"]["units"] = {"fog": {"profile": "rd2100"}}
    with pytest.raises(ValueError, match="gyro driver 'kvh-new': no usual rate is known"):
        open_bench(BenchFile.model_validate(record), VirtualClock())
    gyro["sample_rate_hz"] = 10.0
    opened = open_bench(BenchFile.model_validate(record), VirtualClock())
    assert list(opened.gyros) == ["fog"]
    opened.close()

"""Panels that are locked while labctl controls a chamber, and unlocked on every way to its safe state.

The commands of the P-300 are those of ChamberConnectLibrary 1d2deb8 (p300.py, read_keyprotect and write_keyprotect).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from pydantic import ValidationError

from instruments.errors import LimitError, LinkError, RequestRejected
from instruments.protocols.request_reply.settings import DescribedChamberSettings
from tests.helpers.tap import Tap

Make = Callable[..., Any]


@pytest.fixture
def espec(stand: Make) -> Make:
    def make(**settings: Any) -> Any:
        s = stand("single-axis-sim", chamber={"driver": "espec", "port": "sim://espec", **settings})
        wire = s.bench.simulation.device("sim://espec")
        s.simulated, s.driver = wire._device, s.bench.chamber
        s.tap = s.bench.simulation._devices["sim://espec"] = Tap(wire)
        return s

    return make


def locks(s: Any) -> list[bytes]:
    return [line for line in s.tap.heard if b"KEYPROTECT," in line]


def test_the_panel_is_locked_after_each_set_point_and_free_in_the_safe_state(espec: Make) -> None:
    """The simulated controller refuses changes while it is locked, as it may be with a real one."""
    s = espec(lock_panel=True)
    for wanted_c in (60.0, -20.0):
        assert s.driver.set_temperature_c(wanted_c) == wanted_c
        assert s.simulated.is_locked
        assert s.driver.read().foreign == ()
    assert s.driver.make_safe() == 25.0
    assert not s.simulated.is_locked
    on, off = b"KEYPROTECT,ON\r\n", b"KEYPROTECT,off\r\n"
    assert locks(s) == [on, off, on, off]


def test_no_panel_is_locked_unless_the_bench_file_says_so(espec: Make) -> None:
    s = espec()
    s.driver.set_temperature_c(60.0)
    s.driver.make_safe()
    assert b"KEYPROTECT" not in b"".join(s.tap.heard)
    with pytest.raises(ValidationError, match="lock_panel"):
        espec(driver="thermotron", lock_panel=True)


def test_a_panel_that_a_killed_process_left_locked_is_freed(espec: Make) -> None:
    s = espec(lock_panel=True)
    s.simulated.chamber.run(0.0, on=True)
    s.simulated.is_locked = True
    assert s.driver.make_safe() == 25.0
    assert not s.simulated.is_locked


def test_a_set_point_that_is_refused_leaves_the_panel_free(espec: Make) -> None:
    s = espec(lock_panel=True)
    s.driver.set_temperature_c(60.0)
    before = len(s.tap.heard)
    with pytest.raises(LimitError):
        s.driver.set_temperature_c(500.0)
    assert s.tap.heard[before:] == []
    s.simulated.chamber.program = True
    with pytest.raises(RequestRejected, match="a profile is running"):
        s.driver.set_temperature_c(40.0)
    assert not s.simulated.is_locked


def test_a_panel_that_cannot_be_freed_keeps_no_safe_set_point_from_being_written(
    espec: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    s = espec(lock_panel=True)
    s.driver.set_temperature_c(60.0)
    answer = s.simulated.answer

    def deaf(request: str, t_s: float) -> str | None:
        s.simulated.is_locked = False  # so that only the answer about the lock is missing
        return None if "KEYPROTECT" in request else answer(request, t_s)

    monkeypatch.setattr(s.simulated, "answer", deaf)
    with pytest.raises(LinkError, match="panel is locked"):
        s.driver.make_safe()
    assert s.simulated.chamber.setpoint_c == 25.0


def test_a_controller_without_a_panel_lock_is_reported(espec: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    s = espec(lock_panel=True)
    answer = s.simulated.answer
    monkeypatch.setattr(
        s.simulated,
        "answer",
        lambda request, t_s: "OK:" if "," in request and "KEY" in request else answer(request, t_s),
    )
    with pytest.raises(RequestRejected, match="the panel is not locked after the command; leave lock_panel out of the"):
        s.driver.set_temperature_c(60.0)


def described(stand: Make, monkeypatch: pytest.MonkeyPatch) -> tuple[Any, list[str]]:
    """Return a chamber by description with `start` and `end`, and what it heard of these."""
    given = {"driver": "line-chamber", "format": "thermotron", "port": "sim://thermotron", "min_c": -40, "max_c": 120}
    document = DescribedChamberSettings.model_validate(given).format.model_dump(exclude_unset=True)
    own = given | {"format": document | {"start": ["LOCK 1"], "end": ["LOCK 0"]}}
    s = stand("single-axis-sim", chamber=own)
    device, heard = s.bench.simulation.device("sim://thermotron")._device, []
    answer = device.answer

    def heard_by(request: str, t_s: float) -> str | None:
        if not request.startswith(("LOCK", "SETP1,")):
            return answer(request, t_s)
        heard.append(request)
        return "0" if request.startswith("LOCK") else answer(request, t_s)

    monkeypatch.setattr(device, "answer", heard_by)
    return s, heard


def test_a_described_chamber_is_taken_by_start_and_given_back_by_end(
    stand: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    s, heard = described(stand, monkeypatch)
    chamber = s.bench.chamber
    chamber.set_temperature_c(60.0)
    chamber.set_temperature_c(70.0)
    chamber.make_safe()
    chamber.set_temperature_c(40.0)
    assert heard == ["LOCK 1", "SETP1,60.0", "SETP1,70.0", "SETP1,25.0", "LOCK 0", "LOCK 1", "SETP1,40.0"]


def test_a_described_chamber_is_given_back_also_where_its_safe_state_is_refused(
    stand: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    s, heard = described(stand, monkeypatch)
    chamber = s.bench.chamber
    s.bench.simulation.device("sim://thermotron")._device.chamber.program = True
    with pytest.raises(RequestRejected):
        chamber.make_safe()
    assert heard == ["LOCK 0"]

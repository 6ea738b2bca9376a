"""A STIM300 that is set otherwise than its bench file says, is another unit, starts anew or does not answer."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from instruments.errors import NoReply, WrongInstrument
from instruments.protocols.stim300.frames import LAYOUTS

Make = Callable[..., Any]
RATE_DPS = 30.0


def unit(stand: Make, device: dict[str, Any] | None = None, **gyro: Any) -> Any:
    """Open a bench with a STIM300; `device` is how the unit is set, `gyro` what its bench file says."""
    return stand("triaxial-sim", gyro=gyro, simulation={"units": {"mems": {"device": device or {}}}})


def mean_dps(s: Any) -> float:
    """Return the mean rate about the table axis at RATE_DPS."""
    s.bench.table.home()
    spin = s.bench.table.spin(RATE_DPS, 4)
    s.gyro.read_latest()
    readings = s.gyro.read(3.0)
    s.bench.table.settle(spin)
    assert (readings.lost, readings.damaged) == (0, 0)
    channel = next(c for c in s.gyro.channels if c.name == "gyro_z")
    return float(channel.value(readings.raw["gyro_z"]).mean())


@pytest.mark.parametrize(
    ("device", "says"),
    [
        (
            {"output_unit": "incremental"},
            "the gyro output unit is INCREMENTAL ANGLE in deg instead of ANGULAR RATE or AVERAGE",
        ),
        (
            {"output_unit": "integrated"},
            "the gyro output unit is INTEGRATED ANGLE in deg instead of ANGULAR RATE or AVERAGE",
        ),
        ({"sample_rate_hz": 250}, "the sample rate is 250 Hz instead of 125 Hz"),
        ({"datagram": 0xA7}, "the datagram is 0xA7 instead of 0x94"),
        ({"datagram": 0x90}, "the datagram is 0x90 instead of 0x94"),
        ({"crlf": True}, "CR LF on, bench file off"),
        (
            {"sample_rate_hz": 500, "crlf": True},
            "the sample rate is 500 Hz instead of 125 Hz; CR LF on, bench file off; configure",
        ),
    ],
)
def test_a_unit_that_is_set_otherwise_is_refused(stand: Make, device: dict[str, Any], says: str) -> None:
    s = unit(stand, device)
    with pytest.raises(WrongInstrument) as refused:
        s.gyro.identify()
    assert str(refused.value).startswith(
        "mems: the unit on sim://stim300/mems is not configured as the bench file requires: "
    )
    assert says in str(refused.value)
    assert str(refused.value).endswith(
        "configure the unit in its service mode (commands u, m, d), or correct the bench file"
    )


def test_average_rates_are_rates(stand: Make) -> None:
    s = unit(stand, {"output_unit": "average"})
    assert s.gyro.identify().reported["output_unit"] == "average"
    s.gyro.start()
    assert mean_dps(s) == pytest.approx(RATE_DPS, abs=0.5)


@pytest.mark.parametrize("crlf", [False, True])
@pytest.mark.parametrize("datagram", sorted(LAYOUTS))
def test_every_datagram_is_read(stand: Make, datagram: int, crlf: bool) -> None:
    s = unit(stand, options={"datagram": datagram, "crlf": crlf})
    s.gyro.identify()
    s.gyro.start()
    assert mean_dps(s) == pytest.approx(RATE_DPS, abs=0.5)
    warm = [channel for channel in s.gyro.channels if channel.name.startswith("temperature")]
    assert len(warm) == (3 if LAYOUTS[datagram].temperature else 0)
    for channel in warm:
        assert channel.value(s.gyro.read_latest().raw[channel.name])[0] == pytest.approx(25.0, abs=4.0)


def test_the_unit_says_who_it_is(stand: Make) -> None:
    found = unit(stand, {"serial": "N25582405002002"}).gyro.identify()
    assert found.serial == "STIM-0001"
    assert found.reported == {
        "serial": "N25582405002002", "firmware": "12", "revision": "K", "output_unit": "rate",
        "filter_hz": "262 262 262", "g_compensation": "off", "range_dps": "400 400 400", "datagram": "0x94",
        "sample_rate_hz": "125", "bias_trim_dps": "0 0 0",
    }  # fmt: skip


def test_older_firmware_without_a_bias_trim_is_not_waited_for(stand: Make) -> None:
    found = unit(stand, {"bias_trim_dps": None, "filter_hz": 16}).gyro.identify()
    assert "bias_trim_dps" not in found.reported
    assert found.reported["filter_hz"] == "16 16 16"


@pytest.mark.parametrize("written", ["N25582405002002", "25582405002002"])
def test_the_serial_number_of_the_bench_file_is_held_against_the_units(stand: Make, written: str) -> None:
    assert unit(stand, serial=written).gyro.identify().serial == written
    other = unit(stand, {"serial": "N25582405002003"}, serial=written)
    with pytest.raises(
        WrongInstrument,
        match=f"has serial number N25582405002003, but the bench file or the campaign names {written}; connect the",
    ):
        other.gyro.identify()


def test_a_unit_that_does_not_hear_is_told_from_a_silent_one(stand: Make) -> None:
    s = unit(stand, {"mute": True})
    with pytest.raises(NoReply, match=r"does not answer the commands C and I within 1\.5 s; check the wire"):
        s.gyro.identify()
    s = unit(stand, {"mute": True}, options={"ask": False})
    assert s.gyro.identify().reported == {}


def test_answers_to_its_own_questions_are_no_strange_bytes(stand: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    s = unit(stand)
    s.gyro.start()
    wire = s.bench.simulation.device(s.gyro_url)._device

    def answers_only(_: float) -> bytes:
        said, wire._replies = b"".join(wire._replies.values()), {}
        return said

    monkeypatch.setattr(wire, "transmit", answers_only)
    with pytest.raises(
        NoReply, match=r"within 1\.5 s: the unit answers questions \(\d+ bytes\) but sends no reading; "
    ):
        s.gyro.read_latest()


def test_a_lost_reply_is_asked_for_again(stand: Make) -> None:
    s = unit(stand)
    s.faults(s.gyro_url).arm("silence", until_s=0.3)
    assert s.gyro.identify().reported["firmware"] == "12"


def test_datagrams_of_a_start_are_no_damage_and_are_checked(stand: Make) -> None:
    """A unit that lost its power for a moment: what it sends at its start is no data, and no fault of the wire."""
    s = unit(stand)
    s.gyro.start()
    s.gyro.read_latest()
    s.bench.simulation.device(s.gyro_url).receive(b"R\r", s.clock.now_s())
    parts = [s.gyro.read(0.5) for _ in range(4)]
    assert sum(part.damaged for part in parts) == 0
    assert 10 < sum(part.lost for part in parts) < 40  # 0.2 s of silence and two datagrams
    starting = np.concatenate([part.raw["status"] & 0x40 for part in parts]) > 0
    valid = np.concatenate([part.valid for part in parts])
    assert starting.sum() == pytest.approx(60, abs=4)
    assert not valid[starting].any()
    assert valid[~starting].all()


def test_a_unit_that_comes_back_set_otherwise_is_noticed(stand: Make) -> None:
    s = unit(stand)
    s.gyro.start()
    s.gyro.read_latest()
    wire = s.bench.simulation.device(s.gyro_url)._device
    wire._says = {command: _as_incremental(says) for command, says in wire._says.items()}
    wire.receive(b"R\r", s.clock.now_s())
    with pytest.raises(WrongInstrument, match="gyro output unit is INCREMENTAL ANGLE"):
        s.gyro.read(1.0)


def _as_incremental(says: bytes) -> bytes:
    from instruments.protocols.stim300.layouts import crc32_mpeg2

    if says[0] != 0xBC:
        return says
    body = says[:5] + bytes([says[5] | 1]) + says[6:22]
    return body + crc32_mpeg2(body + bytes(2)).to_bytes(4, "big")

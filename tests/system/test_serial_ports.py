"""A cable that goes away under an open port: one error that names the device, whatever the library lets out."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

import pytest

from instruments.clock import VirtualClock
from instruments.drivers.arrick_c4 import ArrickC4
from instruments.drivers.kvh import KVH_DSP3000, KvhGyro
from instruments.drivers.stim300 import Stim300
from instruments.errors import LinkError
from instruments.protocols.arrick_c4_settings import ArrickC4Settings
from instruments.protocols.kvh_lines import KvhSettings
from instruments.protocols.stim300.frames import Stim300Settings
from instruments.transport.factory import Ports


def stim(port: str, clock: VirtualClock) -> Callable[[], Any]:
    unit = Stim300(
        Stim300Settings(name="mems", driver="stim300", port=port, serial="S-1", max_rate_dps=400.0), Ports(clock), clock
    )
    unit.start()
    return unit.read_latest


def kvh(port: str, clock: VirtualClock) -> Callable[[], Any]:
    settings = KvhSettings(name="fog", driver="kvh-dsp3000", port=port, serial="F-1", max_rate_dps=100.0)
    unit = KvhGyro(settings, Ports(clock), clock, model=KVH_DSP3000)
    unit.start()
    return unit.read_latest


def table(port: str, clock: VirtualClock) -> Callable[[], Any]:
    settings = ArrickC4Settings(port=port, max_rate_dps=100.0, acceleration_dps2=50.0)
    found = ArrickC4(settings, Ports(clock), clock)
    found._link.open()
    return found._link.discard_input


@pytest.mark.parametrize("instrument", [stim, kvh, table])
def test_a_cable_that_goes_away_is_a_broken_link(instrument: Callable[..., Callable[[], Any]]) -> None:
    ours, theirs = os.openpty()
    look = instrument(os.ttyname(theirs), VirtualClock())
    os.close(theirs)
    os.close(ours)
    with pytest.raises(LinkError, match=r"the link /dev/pts/\d+ broke"):
        look()

"""Every installed simulated instrument by the kind that its sim:// address names.

They are the entry points of the group `labctl.simulators`: sim://KIND, or sim://KIND/GYRO for a gyro of the bench.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import cast

from instruments.plugins import PluginGroup
from instruments.simulators.links.device import SimulatedDevice
from instruments.simulators.setup import InstrumentSetup

MakeDevice = Callable[[InstrumentSetup], SimulatedDevice]


def _checked(device: object) -> MakeDevice:
    if not callable(device):
        raise TypeError(
            f"{device!r} is not a class or function that makes a simulated instrument from an "
            "InstrumentSetup; correct the entry point"
        )
    return cast(MakeDevice, device)


SIMULATORS: PluginGroup[MakeDevice] = PluginGroup("labctl.simulators", "simulated instrument", _checked)

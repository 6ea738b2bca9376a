"""Every simulated instrument by the kind that its sim:// address names: register a new one here."""

from __future__ import annotations

from collections.abc import Callable

from instruments.simulators.devices.adam6017 import SimulatedAdam6017
from instruments.simulators.devices.arrick_c4 import SimulatedC4
from instruments.simulators.devices.kvh import SimulatedDsp3000, SimulatedRd2100
from instruments.simulators.devices.stim300 import SimulatedStim300
from instruments.simulators.devices.watlow_f4 import SimulatedF4
from instruments.simulators.devices.watlow_f4t import SimulatedF4T
from instruments.simulators.links.device import SimulatedDevice
from instruments.simulators.setup import InstrumentSetup

#: Instrument at sim://KIND or sim://KIND/GYRO.
KINDS: dict[str, Callable[[InstrumentSetup], SimulatedDevice]] = {
    "arrick": SimulatedC4,
    "watlow-f4": SimulatedF4,
    "watlow-f4t": SimulatedF4T,
    "stim300": SimulatedStim300,
    "kvh-dsp3000": SimulatedDsp3000,
    "kvh-rd2100": SimulatedRd2100,
    "adam-6017": SimulatedAdam6017,
}

"""Every driver by the name that a bench file gives it: register a new one here."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from instruments.drivers.arrick_c4 import ArrickC4
from instruments.drivers.gyrostar import Gyrostar
from instruments.drivers.kvh import KVH_DSP3000, KVH_RD2100, KvhGyro
from instruments.drivers.stim300 import Stim300
from instruments.drivers.watlow_f4 import WatlowF4
from instruments.drivers.watlow_f4t import WatlowF4T
from instruments.interfaces.chamber import Chamber
from instruments.interfaces.gyro import Gyro
from instruments.interfaces.table import RateTable

TABLES: dict[str, Callable[..., RateTable]] = {"arrick-c4": ArrickC4}
CHAMBERS: dict[str, Callable[..., Chamber]] = {"watlow-f4": WatlowF4, "watlow-f4t": WatlowF4T}
GYROS: dict[str, Callable[..., Gyro]] = {
    "kvh-dsp3000": partial(KvhGyro, model=KVH_DSP3000),
    "kvh-rd2100": partial(KvhGyro, model=KVH_RD2100),
    "stim300": Stim300,
    "gyrostar": Gyrostar,
}

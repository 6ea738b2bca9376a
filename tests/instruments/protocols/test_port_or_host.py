"""Every device that is at a serial port or behind a TCP port: one rule for its address, and no key of its own."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import pytest
from pydantic import BaseModel, ValidationError

from instruments.bench_config import ChamberSettings, ReferenceSettings, SupplySettings, TableSettings
from instruments.protocols.acutrol3000.settings import Acutrol3000Settings
from instruments.protocols.binder_registers import BinderSettings
from instruments.protocols.library_settings import LibraryChamberSettings, LibraryReferenceSettings
from instruments.protocols.port_or_host import PortOrHostSettings
from instruments.protocols.request_reply.settings import DescribedChamberSettings, DescribedTableSettings
from instruments.protocols.rigol_dp800 import Dp800Settings
from instruments.protocols.text_lines.chamber_settings import EspecSettings
from instruments.protocols.text_lines.reference_lines import LineReferenceSettings

TABLE = {"max_rate_dps": 100.0, "acceleration_dps2": 50.0}
SUPPLY = {"nominal_v": 5.0, "min_v": 4.5, "max_v": 5.5, "current_limit_a": 1.0}
LIBRARY = {"instrument": "pymeasure.instruments.fluke:Fluke7341"}
#: Settings, their kind of instrument, what else a bench file has to give, the TCP port that it need not give.
DEVICES: list[tuple[type[PortOrHostSettings], type[BaseModel], Mapping[str, object], int]] = [
    (Acutrol3000Settings, TableSettings, TABLE, 9878),
    (BinderSettings, ChamberSettings, {}, 10001),
    (EspecSettings, ChamberSettings, {}, 10001),
    (Dp800Settings, SupplySettings, SUPPLY, 5555),
    (DescribedTableSettings, TableSettings, TABLE | {"format": "acutrol-3000"}, 9878),
    (DescribedChamberSettings, ChamberSettings, {"format": "thermotron"}, 8888),
    (LineReferenceSettings, ReferenceSettings, {"model": "omega-ithx"}, 2000),
    (LibraryChamberSettings, ChamberSettings, LIBRARY, 0),
    (LibraryReferenceSettings, ReferenceSettings, LIBRARY, 0),
]


@pytest.mark.parametrize(("settings", "kind", "keys", "tcp_port"), DEVICES)
def test_a_device_is_at_a_port_or_at_a_host(
    settings: type[PortOrHostSettings], kind: type[BaseModel], keys: Mapping[str, object], tcp_port: int
) -> None:
    def url(**address: object) -> str:
        return settings.model_validate({"driver": "any", **keys, **address}).address_url

    for address in ({}, {"port": "/dev/ttyUSB0", "host": "10.0.0.7"}):
        with pytest.raises(ValidationError, match="give either"):
            url(**address)
    assert url(port="/dev/ttyUSB0") == "/dev/ttyUSB0"
    assert url(host="10.0.0.7") == f"socket://10.0.0.7:{tcp_port}"
    assert url(host="10.0.0.7", tcp_port=4000) == "socket://10.0.0.7:4000"
    assert url(host="sim://device") == "sim://device"
    assert issubclass(settings, kind)


@pytest.mark.parametrize(("settings", "kind", "keys"), [device[:3] for device in DEVICES])
def test_the_keys_of_the_kind_of_instrument_stay_as_they_are(
    settings: type[PortOrHostSettings], kind: type[BaseModel], keys: Mapping[str, object]
) -> None:
    stored = list(settings.model_validate({"driver": "any", "port": "COM1", **keys}).model_dump())
    shared = [stored.index(key) for key in kind.model_fields]
    assert all(later > earlier for earlier, later in pairwise(shared))
    assert shared[0] == 0
    assert not PortOrHostSettings.model_fields
    assert settings.model_fields["driver"].default == kind.model_fields["driver"].default

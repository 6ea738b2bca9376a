"""Identity of the instruments of a bench: what they and their USB adapters say, and whether that is what it was.

The readings of two gyros whose ports have changed places must not go under each other's serial number. A unit that says
its own serial number is held to the one that it had when the same `serial` was measured last, on any bench. Where the
wire tells nothing, the USB adapter is held to the one of the last campaign on the bench.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import TypeAdapter

from instruments.bench_config import BenchFile, DeviceSettings, GyroSettings
from instruments.configuration import changed, configuration_of, not_as_stated
from instruments.transport.adapters import adapter_of
from labctl.errors import Conflict
from labctl.store import CampaignRow, Store

OWN, ADAPTER = "serial", "adapter"
Reported = Mapping[str, Mapping[str, str]]
_REPORTED = TypeAdapter(dict[str, dict[str, str]])


def reported_of(bench: BenchFile, reported: Reported) -> dict[str, dict[str, str]]:
    """Return device -> what it says of itself, with the USB adapter of each device on a serial port."""
    identities: dict[str, dict[str, str]] = {}
    for name, section in bench.sections.items():
        adapter = adapter_of(section.port)
        if identity := dict(reported.get(name, {})) | ({ADAPTER: adapter} if adapter else {}):
            identities[name] = identity
    return identities


def reported_in(campaign: CampaignRow) -> dict[str, dict[str, str]]:
    """Return device -> what it said of itself when a campaign began; empty for one before this was recorded."""
    return _REPORTED.validate_python(campaign.bench.get("reported") or {})


def pinned(bench: BenchFile, reported: Reported) -> BenchFile:
    """Return a bench that accepts only the instruments that were reported, where its file names no others."""
    fixed = {name: _pinned(section, reported.get(name, {})) for name, section in bench.instruments.items()}
    named = {
        kind: tuple(_pinned(each, reported.get(each.name, {})) for each in sections)
        for kind, sections in (("gyros", bench.gyros), ("references", bench.references))
    }
    return bench.model_copy(update={**fixed, **named})


def refuse_otherwise_set(bench: BenchFile, reported: Reported) -> None:
    """Raise Conflict where a unit is not set as its bench file states."""
    for gyro in bench.gyros:
        if difference := not_as_stated(gyro.configuration, reported.get(gyro.name, {})):
            raise Conflict(
                f"{gyro.name}: unit {gyro.serial} is not set as the bench file states: {'; '.join(difference)}; set "
                "the unit "
                "so, or correct `configuration` in its section of the bench file"
            )


def refuse_changed(store: Store, bench: BenchFile, reported: Reported) -> None:
    """Raise Conflict where an instrument is another one, or set otherwise, than before, and no bench file says so."""
    for gyro in bench.gyros:
        before = store.campaigns.newest_of_unit(gyro.serial)
        if before is None:
            continue
        then = _reported_then(before, _name_then(before, gyro.serial))
        now = reported.get(gyro.name, {})
        if (was := then.get(OWN)) and (own_identity := now.get(OWN)):
            if own_identity not in {was, gyro.own_serial}:
                raise Conflict(_other_unit(gyro.name, gyro.serial, (was, own_identity), before))
        elif before.bench_name == bench.name:
            _refuse_other_adapter(gyro.name, gyro, then, now, before)
        if then.get(OWN) == now.get(OWN):
            _refuse_other_settings(gyro, then, now, before)
    before = store.campaigns.newest_on_bench(bench.name)
    gyros = {gyro.name for gyro in bench.gyros}
    for name, section in bench.sections.items():
        if before is None or name in gyros:
            continue
        _refuse_other_adapter(name, section, _reported_then(before, name), reported.get(name, {}), before)


def _refuse_other_settings(
    gyro: GyroSettings, then: Mapping[str, str], now: Mapping[str, str], before: CampaignRow
) -> None:
    changes = {name: both for name, both in changed(then, now).items() if name not in gyro.configuration}
    if changes:
        text = ", ".join(f"{name} was {was} and is {new}" for name, (was, new) in changes.items())
        stated = ", ".join(f'{name} = "{new}"' for name, (_, new) in changes.items())
        raise Conflict(
            f"{gyro.name}: unit {gyro.serial} is set otherwise than in campaign {before.id}: {text}. Its calibration "
            "may not hold so. Set the unit as it was; or, if this is meant, state it in the section of the unit in the "
            f"bench file: configuration = {{ {stated} }}"
        )


def _refuse_other_adapter(
    name: str, section: DeviceSettings, then: Mapping[str, str], now: Mapping[str, str], before: CampaignRow
) -> None:
    was, adapter = then.get(ADAPTER, ""), now.get(ADAPTER, "")
    if (
        not was or not adapter or was == adapter or section.adapter is not None
    ):  # a named one is checked when it is opened
        return
    owner = _owner(before, ADAPTER, adapter)
    swapped = f", which {owner} was on: two adapters may be exchanged" if owner else ""
    raise Conflict(
        f"{name}: port {section.port} is on USB adapter {adapter}{swapped}; in campaign {before.id} the adapter "
        f"was {was}. Give the correct port by its path in /dev/serial/by-id, or, if the adapter was replaced, "
        f"set adapter = '{adapter}' in the section of the instrument in the bench file"
    )


def _other_unit(name: str, serial: str, reported: tuple[str, str], before: CampaignRow) -> str:
    was, other_serial = reported
    owner = _owner(before, OWN, other_serial)
    swapped = f", which {owner} had: the two are exchanged" if owner and owner != name else ""
    return (
        f"{name}: the unit reports serial number {other_serial}{swapped}, but in campaign {before.id} unit {serial} "
        f"reported {was}. Connect the right unit; or, for another unit, give it a different `serial`; or, if "
        f"this is the right unit, set own_serial = '{other_serial}' in the bench file"
    )


def _owner(before: CampaignRow, what: str, value: str) -> str:
    """Return the device that reported a value in a campaign; empty for none."""
    then = reported_in(before)
    return next((name for name, identity in then.items() if identity.get(what) == value), "")


def _name_then(before: CampaignRow, serial: str) -> str:
    gyros: Any = before.bench.get("gyros") or ()
    return next((str(gyro["name"]) for gyro in gyros if gyro.get("serial") == serial), "")


def _reported_then(before: CampaignRow, name: str) -> Mapping[str, str]:
    return reported_in(before).get(name, {})


def _pinned(section: DeviceSettings, reported: Mapping[str, str]) -> DeviceSettings:
    known: dict[str, object] = {"adapter": reported.get(ADAPTER)}
    if isinstance(section, GyroSettings):
        known["own_serial"] = reported.get(OWN)
    update = {key: value for key, value in known.items() if value and getattr(section, key) is None}
    if isinstance(section, GyroSettings):
        update["configuration"] = configuration_of(reported) | section.configuration
    return section.model_copy(update=update)

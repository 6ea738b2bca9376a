"""Units: who they are and what is known of them."""

from __future__ import annotations

from labctl.errors import NotCertified
from labctl.exports import export_formats
from labctl.services.schemas.units import ExportFormatResponse, UnitResponse
from labctl.store import Store, Unit


def list_units(store: Store) -> list[UnitResponse]:
    """Return every unit."""
    return [_answer(store, found) for found in store.units.all()]


def unit(store: Store, serial: str) -> UnitResponse:
    """Return one unit; raises NotFound."""
    return _answer(store, store.units.get(serial))


def _answer(store: Store, found: Unit) -> UnitResponse:
    try:
        certified = store.calibrations.certified_version(found.serial)
    except NotCertified:
        certified = None
    return UnitResponse(
        serial=found.serial,
        model=found.model,
        technology=found.technology,
        recordings=[row.id for row in store.recordings.of_unit(found.serial)],
        calibrations=store.calibrations.versions(found.serial),
        certified_version=certified,
        formats=[
            ExportFormatResponse(id=name, title=each.title, suffix=each.suffix)
            for name, each in export_formats().items()
        ],
    )

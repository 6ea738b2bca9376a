"""The environment of the room: readings typed or logged, each in its one unit, and those of a campaign."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta

from labctl.answers.validity import (
    RoomEnvironmentRequest,
    RoomEnvironmentResponse,
    RoomReadingResponse,
    RoomSpanResponse,
    RoomValue,
)
from labctl.errors import BadInput
from labctl.store import RoomReading, RoomSpan, Store

MAX_READINGS = 1000
#: The clock of a logger may be ahead of that of the service by so much.
AHEAD = timedelta(minutes=5)


@dataclass(frozen=True)
class RoomQuantity:
    """A quantity as it is stored: its unit, its limits there, and other units that are accepted."""

    unit: str
    low: float
    high: float
    other: Mapping[str, Callable[[float], float]]


QUANTITIES: Mapping[str, RoomQuantity] = {
    "temperature": RoomQuantity(
        "deg C", -40.0, 60.0, {"K": lambda value: value - 273.15, "deg F": lambda value: (value - 32.0) / 1.8}
    ),
    "humidity": RoomQuantity("%", 0.0, 100.0, {}),
    "pressure": RoomQuantity(
        "hPa", 500.0, 1200.0,
        {"mbar": lambda value: value, "kPa": lambda value: 10.0 * value, "Pa": lambda value: value / 100.0},
    ),
}  # fmt: skip


def add_readings(store: Store, request: RoomEnvironmentRequest, at: datetime) -> RoomEnvironmentResponse:
    """Enter readings; all or none. Raises BadInput for a unit or a value that cannot be, and for a time to come."""
    rows = []
    for record in request.readings:
        measured_at = record.measured_at or at
        if measured_at > at + AHEAD:
            raise BadInput(f"measured_at {measured_at.isoformat()} is a time to come; correct the clock of the logger")
        for value in record.values:
            unit_symbol, converted = _converted(value)
            rows.append(RoomReading(measured_at, request.bench, value.quantity, unit_symbol, converted, request.source))
    store.room_environment.add(rows, at, request.by)
    return environment(store, min(row.measured_at for row in rows), max(row.measured_at for row in rows), request.bench)


def _converted(entered: RoomValue) -> tuple[str, float]:
    known = QUANTITIES[entered.quantity]
    if entered.unit != known.unit and entered.unit not in known.other:
        accepted = ", ".join([known.unit, *known.other])
        raise BadInput(
            f"{entered.quantity} {entered.value:g} {entered.unit}: the unit is not accepted; give {accepted}"
        )
    value = entered.value if entered.unit == known.unit else known.other[entered.unit](entered.value)
    if not (math.isfinite(value) and known.low <= value <= known.high):
        raise BadInput(
            f"{entered.quantity} {entered.value:g} {entered.unit} is outside {known.low:g} to {known.high:g} "
            f"{known.unit}; correct the value or its unit"
        )
    return known.unit, value


def environment(store: Store, first: datetime, last: datetime, bench: str = "") -> RoomEnvironmentResponse:
    """Return the readings between two aware instants that hold for a bench. Raises BadInput for a wrong order."""
    if last < first:
        raise BadInput(f"until {last.isoformat()} is before from {first.isoformat()}; exchange the two")
    return RoomEnvironmentResponse(
        spans=[
            RoomSpanResponse(
                quantity=span.quantity, unit=span.unit, low=span.low, high=span.high, readings=span.readings
            )
            for span in store.room_environment.spans(first, last, bench)
        ],
        readings=[
            RoomReadingResponse(
                measured_at=reading.measured_at, bench=reading.bench_name, quantity=reading.quantity, unit=reading.unit,
                value=reading.value, source=reading.source,
            )
            for reading in store.room_environment.readings(first, last, bench, MAX_READINGS)
        ],
    )  # fmt: skip


def of_campaign(store: Store, number: int) -> list[RoomSpan]:
    """Return the environment of the room while a campaign ran; nothing for one that has not begun or not ended."""
    campaign = store.campaigns.get(number)
    if campaign.started_at is None or campaign.ended_at is None:
        return []
    return store.room_environment.spans(campaign.started_at, campaign.ended_at, campaign.bench_name)

"""`labctl environment`: temperature, humidity and pressure of the room, typed; a logger sends them over HTTP."""

from __future__ import annotations

from datetime import timedelta
from typing import Annotated

import typer

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import Database, Json, day, instant
from labctl.cli.output import console, format_number, print_json, table

app = typer.Typer(no_args_is_help=True, help="Environment of the room: temperature, humidity, pressure.")

Bench = Annotated[str, typer.Option("--bench", metavar="NAME", help="Bench that it holds for; default: all benches.")]


@app.command("add")
def add(
    source: Annotated[str, typer.Option("--source", metavar="TEXT", help="Instrument that was read, with its number.")],
    temperature_c: Annotated[
        float | None, typer.Option("--temperature-c", metavar="T", help="Temperature of the room, deg C.")
    ] = None,
    humidity_pct: Annotated[
        float | None, typer.Option("--humidity-pct", metavar="RH", help="Relative humidity, %.")
    ] = None,
    pressure_hpa: Annotated[
        float | None, typer.Option("--pressure-hpa", metavar="P", help="Air pressure, hPa.")
    ] = None,
    at: Annotated[str | None, typer.Option("--at", metavar="TIME", help="Time of the reading; default: now.")] = None,
    bench: Bench = "",
    by: Annotated[
        str | None, typer.Option("--by", metavar="NAME", help="Who read it; default: the user who is logged in.")
    ] = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Enter a reading of the room; certificates state the least and the largest of their campaign."""
    from labctl.acting_user import actor
    from labctl.answers.validity import RoomEnvironmentRequest, RoomRecord, RoomValue
    from labctl.errors import BadInput
    from labctl.services.commands.open import execute
    from labctl.services.commands.standards import ADD_ENVIRONMENT

    with one_clear_line():
        values = [
            RoomValue.model_validate({"quantity": quantity, "value": value, "unit": unit_symbol})
            for quantity, value, unit_symbol in (
                ("temperature", temperature_c, "deg C"),
                ("humidity", humidity_pct, "%"),
                ("pressure", pressure_hpa, "hPa"),
            )
            if value is not None
        ]  # fmt: skip
        if not values:
            raise BadInput("nothing was read: give --temperature-c, --humidity-pct or --pressure-hpa")
        record = RoomRecord(measured_at=instant(at, "--at"), values=values)
        request = RoomEnvironmentRequest(readings=[record], source=source, bench=bench, by=by or actor().name)
        answer = execute(database, ADD_ENVIRONMENT, request)
    if as_json:
        print_json(answer)
        return
    for reading in answer.readings[: len(values)]:
        console.print(
            f"{reading.measured_at:%Y-%m-%d %H:%M}  {reading.quantity} {reading.value:g} {reading.unit}", markup=False
        )


@app.command("show")
def show(
    begin: Annotated[str | None, typer.Option("--from", metavar="DATE", help="First day; default: yesterday.")] = None,
    end: Annotated[str | None, typer.Option("--until", metavar="DATE", help="Last day; default: today.")] = None,
    bench: Bench = "",
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Show least and largest reading of each quantity."""
    from datetime import UTC, datetime, time

    from instruments.clock import SystemClock
    from labctl.services.read_access import open_readonly
    from labctl.services.room_environment import environment

    with one_clear_line(), open_readonly(database) as store:
        last = day(end, "--until") or SystemClock().utc().date()
        first = day(begin, "--from") or last - timedelta(days=1)
        spans = datetime.combine(first, time.min, UTC), datetime.combine(last, time.max, UTC)
        answer = environment(store, *spans, bench)
    if as_json:
        print_json(answer)
        return
    rows = table("", "quantity", "unit", "least", "largest", "readings", numbers=3)
    for span in answer.spans:
        rows.add_row(span.quantity, span.unit, format_number(span.low), format_number(span.high), str(span.readings))
    console.print(rows)

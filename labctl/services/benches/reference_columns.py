"""The reference instruments of a campaign's bench: the columns that they add to every recording."""

from __future__ import annotations

from instruments.bench import Bench
from instruments.bench_config import BenchFile
from instruments.interfaces.gyro import Channel
from labctl.answers.raw_channels import RawChannelJson
from labctl.errors import BadInput

#: Column of a recording that a fit takes as the temperature.
TEMPERATURE = "temperature_c"


def raw_channel(channel: Channel) -> RawChannelJson:
    """Return a channel as it is stored."""
    return {"name": channel.name, "unit": channel.unit, "scale": channel.scale, "offset": channel.offset}


def reference_channels(bench: Bench, bench_file: BenchFile) -> tuple[RawChannelJson, ...]:
    """Return the channels of every reference instrument, the chosen temperature marked, and that of the supply.

    Raises BadInput for two of one name, and for a chosen instrument that measures no temperature.
    """
    raw_channels: list[RawChannelJson] = []
    for settings in bench_file.references:
        channels = [raw_channel(channel) for channel in bench.references[settings.name].channels]
        refuse_doubled_columns(settings.name, tuple(channels), tuple(raw_channels))
        if settings.is_temperature:
            temperature_channel = next((each for each in channels if each["unit"] == "deg C"), None)
            if temperature_channel is None:
                raise BadInput(
                    f"{settings.name}: is_temperature is set, but this instrument measures no temperature; set "
                    "is_temperature for a thermometer"
                )
            temperature_channel["stands_for"] = TEMPERATURE
        raw_channels += channels
    if bench.supply is not None:
        channels = [raw_channel(channel) for channel in bench.supply.channels]
        refuse_doubled_columns(bench.supply.name, tuple(channels), tuple(raw_channels))
        raw_channels += channels
    return tuple(raw_channels)


def refuse_doubled_columns(name: str, channels: tuple[RawChannelJson, ...], others: tuple[RawChannelJson, ...]) -> None:
    """Raise BadInput where a column would have two sources."""
    if doubled := {channel["name"] for channel in channels} & {other["name"] for other in others}:
        column = min(doubled)
        raise BadInput(
            f"{name}: column {column} has another source already; set columns = "
            f'{{ {column} = "other_{column}" }} in its [[references]], or column = "other_{column}" in [supply]'
        )


def temperature_instrument(bench: BenchFile) -> str:
    """Return the name of the reference instrument by whose temperature the units are fitted; empty: their own."""
    return next((reference.name for reference in bench.references if reference.is_temperature), "")


def reference_notes(bench: BenchFile) -> str:
    """Return what a recording says about the instrument whose temperature it is fitted by; empty for the unit's own."""
    for reference in bench.references:
        if reference.is_temperature:
            parts = [f"temperature_c is by {reference.name}", reference.model_dump().get("model", ""), reference.serial]
            if reference.certificate:
                parts.append(f"certificate {reference.certificate}")
            if reference.u_c is not None:
                parts.append(f"standard uncertainty {reference.u_c:g} K")
            return ", ".join(part for part in parts if part)
    return ""

"""Gain of each output against the table: sign, unit, scale, axes exchanged, an output that does not follow."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from labctl.answers.output_units import RATE_UNITS
from labctl.answers.recording_head import OutputUnit
from labctl.recording.positions import Position
from labctl.recording.sanity.finding import Finding
from labctl.recording.sanity.response import Response
from labctl.recording.sanity.summary import Summary

#: Gains of a gyro in deg/s, and those that are odd but possible.
USUAL, POSSIBLE = (0.7, 1.4), (0.5, 2.0)
#: An output that follows another axis: its own gain is below this share of the largest.
CROSSED_SHARE = 0.3
#: A gain within this share of a known factor is that factor.
NEAR_FACTOR = 0.15
#: A gain this many uncertainties from 0 is a response.
SIGNIFICANT = 10.0
#: Outputs whose size follows the table this well, and whose sign does not, belong to rates without a sign.
UNSIGNED_CORRELATION = 0.99
EXPECTED = "a gain of 0.7 to 1.4"


@dataclass(frozen=True)
class Factor:
    """A gain that a wrong unit gives."""

    gain: float
    cause: str


FACTORS = (
    Factor(math.pi / 180, "pi/180: the output is in rad/s"),
    Factor(180 / math.pi, "180/pi: the output is in deg/s and declared as rad/s, or the table's rate is in rad/s"),
    Factor(1 / 3600, "1/3600: the output is in deg/s and declared as deg/h"),
    Factor(3600.0, "3600: the output is in deg/h"),
    Factor(1 / 60, "1/60: the output is in deg/s, the table's rate per minute"),
    Factor(6.0, "6: the table's rate is in turns per minute"),
    Factor(1 / 6, "1/6: the output is in turns per minute"),
)


def check_responses(summary: Summary, responses_by_axis: Mapping[str, Mapping[str, Response]]) -> Iterator[Finding]:
    """Yield what is wrong with known responses."""
    by_axis: dict[str, list[tuple[str, Response]]] = {}
    crossed: dict[str, str] = {}  # position -> the output that follows the table instead
    for position, outputs in responses_by_axis.items():
        axis = Position.of(position).axis
        if axis not in outputs:
            continue
        if (other := _follower(axis, outputs)) is not None:
            crossed[position] = other
        else:
            by_axis.setdefault(axis, []).append((position, outputs[axis]))
    yield from _crossed(crossed, responses_by_axis)
    for axis, own_response in by_axis.items():
        yield from _of_axis(summary, axis, own_response)


def _follower(axis: str, outputs: Mapping[str, Response]) -> str | None:
    """Return the output that follows the table where the axis that should does not; None where all is well."""
    others = {name: output for name, output in outputs.items() if name != axis and output.is_known}
    if not others:
        return None
    name, strongest = max(others.items(), key=lambda item: abs(item[1].gain))
    is_response = abs(strongest.gain) > SIGNIFICANT * strongest.u
    return name if is_response and abs(outputs[axis].gain) < CROSSED_SHARE * abs(strongest.gain) else None


def _crossed(crossed: Mapping[str, str], responses_by_axis: Mapping[str, Mapping[str, Response]]) -> Iterator[Finding]:
    reported: set[frozenset[str]] = set()
    for position, other in crossed.items():
        axis = Position.of(position).axis
        mutual = [p for p, o in crossed.items() if {Position.of(p).axis, o} == {axis, other}]
        exchanged = {Position.of(p).axis for p in mutual} == {axis, other}
        if exchanged and (pair := frozenset((axis, other))) not in reported:
            reported.add(pair)
            place_text, do = (
                f"axes {min(pair)} and {max(pair)}",
                f"exchange columns gyro_{min(pair)} and gyro_{max(pair)}, or the positions",
            )
        elif exchanged:
            continue
        else:
            place_text = f"position {position}"
            do = (
                f"mark these data sets with the position in which the unit was mounted ({other}?), or correct the "
                "columns' order"
            )
        gain = responses_by_axis[position][other].gain
        yield Finding(
            "axes", "certain", place_text,
            f"while axis {axis} is along the table's axis, output {axis} has gain "
            f"{responses_by_axis[position][axis].gain:.3g} "
            f"and output {other} has gain {gain:.3g}",
            gain, "1", f"output {axis} to follow", do,
        )  # fmt: skip


def _of_axis(summary: Summary, axis: str, responses: list[tuple[str, Response]]) -> Iterator[Finding]:
    signed = [(position, -one.gain if Position.of(position).sign < 0 else one.gain, one) for position, one in responses]
    for position, one in responses:
        if (finding := _unsigned(summary, position, one)) is not None:
            yield finding
            return
    signed = [entry for entry in signed if entry[2].is_known]
    if not signed:
        return
    gains = [gain for _, gain, _ in signed]
    negative = [position for position, gain, one in signed if gain < -SIGNIFICANT * one.u]
    if negative and len(negative) < len(signed):
        place_text = f"axis {axis}, position {', '.join(negative)}"
        yield _sign(place_text, min(gains), f"mark these data sets as position {_turned(negative[0])}")
    elif negative and POSSIBLE[0] <= abs(float(np.median(gains))) <= POSSIBLE[1]:
        scale = _output_unit(summary, axis).scale
        do = f"give [output.{axis}] scale = {-scale:.6g}, or correct the sign of the table's rate or the position"
        yield _sign(f"axis {axis}", float(np.median(gains)), do)
    yield from _size(summary, axis, signed)


def _sign(where: str, gain: float, do: str) -> Finding:
    text = f"the output decreases when the table turns faster: gain {gain:.3g} (output rate divided by table rate)"
    return Finding("sign", "certain", where, text, gain, "1", "a gain near 1", do)


def _output_unit(summary: Summary, axis: str) -> OutputUnit:
    return next((output_unit for name, output_unit in summary.info.output.items() if name == axis), OutputUnit())


def _turned(position: str) -> str:
    return str(Position.of(position).upside_down)


def _size(summary: Summary, axis: str, signed: list[tuple[str, float, Response]]) -> Iterator[Finding]:
    # the position furthest from 1 decides: a wrong one among right ones must not vanish in their median
    position, gain, one = max(signed, key=lambda entry: abs(math.log(max(abs(entry[1]), 1e-12))))
    size = abs(gain)
    if USUAL[0] <= size <= USUAL[1]:
        return
    place_text = f"axis {axis}" if len(signed) == 1 else f"axis {axis}, position {position}"
    if size < max(SIGNIFICANT * one.u, 1e-9):
        text = (
            f"the output does not follow the table: gain {gain:.3g} (output rate divided by table rate), u = "
            f"{one.u:.2g}"
        )
        do = "check that the table turned, that this axis is along it, and which column is the output"
        yield Finding("no_response", "certain", place_text, text, gain, "1", EXPECTED, do)
        return
    output = _output_unit(summary, axis)
    factor = next((f for f in FACTORS if abs(size / f.gain - 1) < NEAR_FACTOR), None)
    if factor is not None:
        text = f"the gain (output rate divided by table rate) is {gain:.4g}, near {factor.cause}"
        do = _right_unit(axis, math.copysign(output.scale * factor.gain, output.scale * gain))
        yield Finding("unit", "certain", place_text, text, gain, "1", EXPECTED, do)
        return
    odd = POSSIBLE[0] <= size <= POSSIBLE[1]
    text = f"gain {gain:.4g}" + ("" if odd else ": the output is not in the unit that is stated")
    do = (
        f"give unit and scale of the output (raw counts, mV?); with [output.{axis}] scale = "
        f"{output.scale * gain:.6g} the gain is 1"
    )
    yield Finding("scale", "likely" if odd else "certain", place_text, text, gain, "1", EXPECTED, do)


def _right_unit(axis: str, scale: float) -> str:
    """Return how to state the unit in which an output is; its own factor, so that the scale factor error remains."""
    unit = next((name for name, own in RATE_UNITS.items() if math.isclose(own, scale, rel_tol=1e-9)), None)
    if unit is None:
        return (
            f"correct the unit of the output or of the table's rate and import again; with [output.{axis}] scale = "
            f"{scale:.6g} the output is in the unit that the gain suggests"
        )
    return (
        f'state {unit} as the unit of this output, in the map of the columns or as [output.{axis}] unit = "{unit}" in '
        "recording.toml, and import again"
    )


def _unsigned(summary: Summary, position: str, response: Response) -> Finding | None:
    """Return a finding where the table's rates have lost their sign: the outputs have two, the rates one."""
    rate = np.asarray(summary["table_rate_dps"], dtype=np.float64)[response.rows]
    output = summary.of_axis("mean", response.output)[response.rows]
    fast = np.abs(rate) > 0.1 * np.abs(rate).max()
    if not (np.all(rate >= 0) or np.all(rate <= 0)) or fast.sum() < 4:
        return None
    signs = np.sign(output[fast])
    if min(np.sum(signs > 0), np.sum(signs < 0)) < 2:
        return None
    sizes = np.abs(output)
    if np.ptp(np.abs(rate)) == 0 or np.corrcoef(np.abs(rate), sizes)[0, 1] < UNSIGNED_CORRELATION:
        return None
    opposite = int(min(np.sum(signs > 0), np.sum(signs < 0)))
    return Finding(
        "sign", "certain", f"column table_rate_dps, position {position}",
        f"all rates have the same sign, but output {response.output} has the opposite sign in {opposite} of "
        f"{int(fast.sum())} data sets",
        float(opposite), "data sets", "signed rates", "give the table's rates with their sign",
    )  # fmt: skip

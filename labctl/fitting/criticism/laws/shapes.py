"""The shapes that a law is made of: functions of one channel or the rate, and products of both, as formulas.

A shape is a formula with named constants, so that a search may move them: `k` is a place, `w` a width, `f` a frequency
(rad), `g` a growth. Channels enter as (channel - centre) / half
of their range, the rate as rate / largest rate: constants are then shares of what was measured, and a coefficient is
the size of the error in deg/s.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np

from labctl.fitting.criticism.channel_functions import smooth_channels
from labctl.fitting.criticism.reduction import ReducedRecording
from labctl.fitting.effects.formula import OWN_RATE
from labctl.fitting.numeric.arrays import Array

#: Names of the rate among the channels of a verdict, and in a formula.
TABLE_RATE, TEMPERATURE = "table_rate_dps", "temperature_c"
#: Significant digits of a constant.
DIGITS = 3
#: Where knees, steps and bumps stand, as shares of the range, and how wide they are.
PLACES = tuple(round(float(at), 2) for at in np.linspace(-0.8, 0.8, 9))
PLACES_OF_RATE = tuple(round(float(at), 2) for at in np.linspace(0.1, 0.9, 9))
WIDTHS = (0.1, 0.25, 0.6)
#: Waves over half the range.
WAVES = tuple(round(float(np.pi * n), 2) for n in np.arange(0.5, 6.1, 0.25))
GROWTHS = (-1.5, -4.0, 1.5, 4.0)
#: Phase of a wave from one value to the next at most, rad: three quarters of what equal distances distinguish.
FASTEST_PHASE = 0.75 * np.pi
#: A width and a growth stay within this factor of where they began, a frequency within that; a place moves so far.
MAX_FACTOR, MAX_FREQUENCY_FACTOR, MAX_MOVE, MAX_MOVE_OF_RATE = 3.0, 1.3, 0.25, 0.15
#: Least size of a rate at which a knee, a step or a bump stands.
MIN_PLACE_OF_RATE = 0.02


@dataclass(frozen=True)
class Shape:
    """A formula of `{u}`, what it is a function of, and of named constants; or a sine and a cosine of one frequency."""

    kind: str  #: in words
    texts: tuple[str, ...]  #: one formula, or a sine and a cosine
    constants: Mapping[str, float] = field(default_factory=dict)
    nodes: int = 1  #: how long it is to write
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)  #: constant -> where it may move to

    def formulas(self, constants: Mapping[str, float] | None = None) -> tuple[str, ...]:
        """Return the formulas with constants in place of their names."""
        values = {name: _number(value) for name, value in {**self.constants, **(constants or {})}.items()}
        return tuple(text.format(**values) for text in self.texts)

    def of(self, argument: str) -> Shape:
        """Return the shape of an argument, a formula."""
        return replace(self, texts=tuple(text.replace("{u}", argument) for text in self.texts))

    def times(self, factor: str, words: str) -> Shape:
        """Return the shape times a formula."""
        texts = tuple(f"{factor} * {text}" for text in self.texts)
        return replace(self, kind=f"{self.kind} {words}".strip(), texts=texts, nodes=self.nodes + 1)


def _number(value: float) -> str:
    text = f"{value:.{DIGITS}g}"
    return f"({text})" if value < 0 else text


#: Of a channel.
OF_CHANNEL = (
    Shape("line", ("{u}",)),
    *(Shape(f"power {k}", (f"{{u}}**{k}",)) for k in (2, 3, 4)),
    *(Shape("knee", ("(abs({u} - {k}) + {u} - {k})",), {"k": k}, 2) for k in PLACES),
    *(Shape("step", ("tanh(({u} - {k})/{w})",), {"k": k, "w": w}, 3) for k, w in product(PLACES, WIDTHS)),
    *(Shape("bump", ("exp(-(({u} - {k})/{w})**2)",), {"k": k, "w": w}, 3) for k, w in product(PLACES, WIDTHS)),
    *(Shape("exponential", ("exp({g}*{u})",), {"g": g}, nodes=2) for g in GROWTHS),
    *(Shape("wave", ("sin({f}*{u})", "cos({f}*{u})"), {"f": f}, nodes=3) for f in WAVES),
)
#: Of the size of the rate, the same for both directions; times its sign they are odd.
OF_SPEED = (
    Shape("size", ("abs({u})",)),
    *(Shape(f"power {k:g} of the size", (f"abs({{u}})**{k:g}",)) for k in (0.5, 1.5, 2.0, 3.0, 4.0, 5.0)),
    *(Shape("knee", ("(abs(abs({u}) - {k}) + abs({u}) - {k})",), {"k": k}, nodes=2) for k in PLACES_OF_RATE),
    *(Shape("saturation", ("tanh(abs({u})/{w})",), {"w": w}, nodes=2) for w in (0.03, 0.1, 0.3, 0.7)),
    *(Shape("decay", ("exp(-abs({u})/{w})",), {"w": w}, nodes=2) for w in (0.03, 0.1, 0.3, 0.7)),
    *(
        Shape("step", ("tanh((abs({u}) - {k})/{w})",), {"k": k, "w": w}, nodes=3)
        for k, w in product(PLACES_OF_RATE, (0.05, 0.2))
    ),
    *(
        Shape("bump", ("exp(-((abs({u}) - {k})/{w})**2)",), {"k": k, "w": w}, nodes=3)
        for k, w in product(PLACES_OF_RATE, (0.1, 0.25))
    ),
)
WAVES_OF_RATE = (
    *(Shape("odd wave", ("sin({f}*{u})",), {"f": f}, nodes=2) for f in WAVES),
    *(Shape("even wave", ("cos({f}*{u})",), {"f": f}, nodes=2) for f in WAVES),
)


@dataclass(frozen=True)
class Scale:
    """A channel as it enters a formula: less its centre, over half its range; the rate over the largest."""

    name: str
    text: str
    gap: float  #: largest distance between neighbouring values, in the same unit


def scales_of(data: ReducedRecording, channels: Sequence[str]) -> dict[str, Scale]:
    """Return channel -> its scale, of the channels of a verdict that vary; the rate is never centred."""
    axis = str(data.info.axes[0])
    known = smooth_channels(data, axis)
    fastest = max(float(np.abs(data.nodes.rate_dps(str(each))).max()) for each in data.info.axes)
    scales = {}
    for name in channels:
        if name == TABLE_RATE and fastest > 0:
            largest = _rounded(fastest)
            rates = np.abs(np.concatenate([data.nodes.rate_dps(str(each)) for each in data.info.axes]))
            scales[name] = Scale(name, f"({OWN_RATE}/{largest:g})", _gap(rates / largest))
        elif name in known and name in (*data.nodes.columns, TEMPERATURE):
            scales[name] = _scale(name, _values(data, name, axis))
    return scales


def _values(data: ReducedRecording, name: str, axis: str) -> Array:
    if name == TEMPERATURE:
        return data.nodes.temperature_c(axis)
    return np.asarray(data.nodes[name], dtype=np.float64)


def _scale(name: str, values: Array) -> Scale:
    low, high = float(values.min()), float(values.max())
    half = _rounded((high - low) / 2)
    centre = float(f"{round((low + high) / 2 / half, 2) * half:.{DIGITS + 2}g}")
    inner = name if centre == 0 else f"({name} {'-' if centre > 0 else '+'} {abs(centre):.10g})"
    return Scale(name, f"({inner}/{half:g})", _gap(values / half))


def _gap(values: Array) -> float:
    """Return the largest distance between neighbouring values, to a hundredth."""
    return float(np.diff(np.unique(np.round(values, 2))).max(initial=0.0))


def _seen(shapes: Iterable[Shape], scale: Scale) -> Iterator[Shape]:
    """Yield the shapes that the values of a channel show, with the bounds of their constants.

    None is narrower than the distance of the values, and no wave faster than they resolve: between them it would say
    what was not measured.
    """
    for shape in shapes:
        if shape.constants.get("w", np.inf) >= scale.gap and shape.constants.get("f", 0.0) * scale.gap <= FASTEST_PHASE:
            yield replace(shape, bounds={name: _bounds(name, value, scale) for name, value in shape.constants.items()})


def _bounds(name: str, value: float, scale: Scale) -> tuple[float, float]:
    """Return where a constant may move to."""
    if name == "k" and scale.name == TABLE_RATE:
        return max(value - MAX_MOVE_OF_RATE, MIN_PLACE_OF_RATE), value + MAX_MOVE_OF_RATE
    if name == "k":
        return value - MAX_MOVE, value + MAX_MOVE
    factor = MAX_FREQUENCY_FACTOR if name == "f" else MAX_FACTOR
    low, high = sorted((value / factor, value * factor))
    fastest = FASTEST_PHASE / scale.gap if scale.gap else np.inf
    return (max(low, scale.gap) if name == "w" else low), (min(high, fastest) if name == "f" else high)


def _rounded(value: float) -> float:
    return float(f"{value:.2g}")


def library(scales: Mapping[str, Scale]) -> list[Shape]:
    """Return every shape that a term of a law may have: of each channel, and of each pair of channels as a product."""
    rate = scales.get(TABLE_RATE)
    shapes: list[Shape] = []
    if rate is not None:
        shapes += [shape.of(rate.text) for shape in _of_rate(rate)]
    for scale in scales.values():
        if scale is rate:
            continue
        of_channel = [_named(shape, scale) for shape in _seen(OF_CHANNEL, scale)]
        shapes += of_channel
        if rate is None:
            continue
        shapes += [
            shape.times(factor.format(u=rate.text), f"times {words}")
            for shape in of_channel
            for factor, words in (("{u}", "the rate"), ("abs({u})", "its size"), ("{u}**2", "its square"))
        ]
        shapes += [
            shape.of(rate.text).times(factor.format(u=scale.text), f"times {words} {scale.name}")
            for shape in _of_rate(rate)
            for factor, words in (("{u}", "the"), ("{u}**2", "the square of the"))
        ]
    shapes += _of_two([scale for scale in scales.values() if scale is not rate])
    return list({shape.formulas(): shape for shape in shapes}.values())


def _of_rate(rate: Scale) -> Iterator[Shape]:
    for shape in _seen(OF_SPEED, rate):
        yield shape
        yield replace(shape.times("sign({u})", ""), kind=f"{shape.kind}, odd")
    yield from _seen(WAVES_OF_RATE, rate)


def _named(shape: Shape, scale: Scale) -> Shape:
    return replace(shape.of(scale.text), kind=f"{shape.kind} of {scale.name}")


def _of_two(scales: Sequence[Scale]) -> list[Shape]:
    """Return products of low powers of two channels."""
    pairs = [(one, other) for i, one in enumerate(scales) for other in scales[i + 1 :]]
    return [
        Shape(f"product of {one.name} and {other.name}", (f"{one.text}{a} * {other.text}{b}",), nodes=3)
        for one, other in pairs
        for a, b in (("", ""), ("**2", ""), ("", "**2"), ("**2", "**2"))
    ]

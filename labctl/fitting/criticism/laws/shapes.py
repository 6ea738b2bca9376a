"""The shapes that a law is made of: functions of one channel or the rate, and products of both, as formulas.

A shape is a formula with named constants, so that a search may move them. Channels enter as (channel - centre) / half
of their range, the rate as rate / largest rate: constants are then shares of what was measured, and a coefficient is
the size of the error in deg/s.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
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
#: A constant stays within these factors of where it began.
MOST_CHANGE = 3.0


@dataclass(frozen=True)
class Shape:
    """A formula of `{u}`, what it is a function of, and of named constants; or of several formulas with one phase."""

    kind: str  #: in words
    texts: tuple[str, ...]  #: one formula, or a sine and a cosine
    constants: Mapping[str, float] = field(default_factory=dict)
    places: frozenset[str] = frozenset()  #: constants that are places, and may move to 0 and beyond
    nodes: int = 1  #: how long it is to write
    least: Mapping[str, float] = field(default_factory=dict)  #: what a constant may not fall below

    def formulas(self, constants: Mapping[str, float] | None = None) -> tuple[str, ...]:
        """Return the formulas with constants in place of their names."""
        values = {name: _number(value) for name, value in {**self.constants, **(constants or {})}.items()}
        return tuple(text.format(**values) for text in self.texts)

    def of(self, argument: str) -> Shape:
        """Return the shape of an argument, a formula."""
        return replace(self, texts=tuple(text.replace("{u}", argument) for text in self.texts))

    def times(self, factor: str, words: str) -> Shape:
        """Return the shape times a formula."""
        texts = tuple(factor if text == "1" else f"{factor} * {text}" for text in self.texts)
        return replace(self, kind=f"{self.kind} {words}".strip(), texts=texts, nodes=self.nodes + 1)


def _number(value: float) -> str:
    text = f"{value:.{DIGITS}g}"
    return f"({text})" if value < 0 else text


ONE = Shape("", ("1",), nodes=0)
#: Of a channel.
OF_CHANNEL = (
    Shape("line", ("{u}",)),
    *(Shape(f"power {k}", (f"{{u}}**{k}",)) for k in (2, 3, 4)),
    *(Shape("knee", ("(abs({u} - {k}) + {u} - {k})",), {"k": k}, frozenset("k"), 2) for k in PLACES),
    *(
        Shape("step", ("tanh(({u} - {k})/{w})",), {"k": k, "w": w}, frozenset("k"), 3)
        for k, w in product(PLACES, WIDTHS)
    ),
    *(
        Shape("bump", ("exp(-(({u} - {k})/{w})**2)",), {"k": k, "w": w}, frozenset("k"), 3)
        for k, w in product(PLACES, WIDTHS)
    ),
    *(Shape("exponential", ("exp({w}*{u})",), {"w": w}, nodes=2) for w in GROWTHS),
    *(Shape("wave", ("sin({w}*{u})", "cos({w}*{u})"), {"w": w}, nodes=3) for w in WAVES),
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
    *(Shape("odd wave", ("sin({w}*{u})",), {"w": w}, nodes=2) for w in WAVES),
    *(Shape("even wave", ("cos({w}*{u})",), {"w": w}, nodes=2) for w in WAVES),
)


@dataclass(frozen=True)
class Scale:
    """A channel as it enters a formula: its centre and half its range, rounded."""

    name: str
    text: str
    centre: float
    half: float
    gap: float = 0.0  #: largest distance between neighbouring values, over `half`


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
            scales[name] = Scale(name, f"({OWN_RATE}/{largest:g})", 0.0, largest, _gap(rates / largest))
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
    return Scale(name, f"({inner}/{half:g})", centre, half, _gap(values / half))


def _gap(values: Array) -> float:
    """Return the largest distance between neighbouring values, to a hundredth."""
    return float(np.diff(np.unique(np.round(values, 2))).max(initial=0.0))


def _seen(shape: Shape, gap: float) -> Shape | None:
    """Return a shape that values with such gaps between them show: no narrower, and no faster, than they resolve.

    Between the values a narrower one would say what was not measured.
    """
    width, wave = shape.constants.get("w"), "wave" in shape.kind
    if width is None or "exponential" in shape.kind:
        return shape
    if wave:
        return shape if width * gap <= FASTEST_PHASE else None
    return replace(shape, least={"w": gap}) if width >= gap else None


def _rounded(value: float) -> float:
    return float(f"{value:.2g}")


def library(scales: Mapping[str, Scale]) -> list[Shape]:
    """Return every shape that a term of a law may have: of each channel, and of each pair of channels as a product."""
    rate = scales.get(TABLE_RATE)
    found: list[Shape] = []
    if rate is not None:
        found += [shape.of(rate.text) for shape in _of_rate(rate)]
    for scale in scales.values():
        if scale is rate:
            continue
        of_channel = [_named(shape, scale) for each in OF_CHANNEL if (shape := _seen(each, scale.gap)) is not None]
        found += of_channel
        if rate is None:
            continue
        found += [
            shape.times(factor.format(u=rate.text), f"times {words}")
            for shape in of_channel
            for factor, words in (("{u}", "the rate"), ("abs({u})", "its size"), ("{u}**2", "its square"))
        ]
        found += [
            shape.of(rate.text).times(factor.format(u=scale.text), f"times {words} {scale.name}")
            for shape in _of_rate(rate)
            for factor, words in (("{u}", "the"), ("{u}**2", "the square of the"))
        ]
    found += _of_two([scale for scale in scales.values() if scale is not rate])
    return list({shape.formulas(): shape for shape in found}.values())


def _of_rate(rate: Scale) -> Iterator[Shape]:
    for each in OF_SPEED:
        if (shape := _seen(each, rate.gap)) is not None:
            yield shape
            yield replace(shape.times("sign({u})", ""), kind=f"{shape.kind}, odd")
    yield from (shape for each in WAVES_OF_RATE if (shape := _seen(each, rate.gap)) is not None)


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


def bounds_of(shape: Shape) -> dict[str, tuple[float, float]]:
    """Return constant -> where it may move to, from where it stands."""
    limits = {}
    for name, value in shape.constants.items():
        if name in shape.places:
            limits[name] = (value - 0.25, value + 0.25)
        elif name == "k":
            limits[name] = (max(value - 0.15, 0.02), value + 0.15)
        else:
            factor = 1.3 if "wave" in shape.kind else MOST_CHANGE
            low, high = sorted((value / factor, value * factor))
            limits[name] = (max(low, shape.least.get(name, low)), high)
    return limits

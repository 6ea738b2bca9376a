"""From the bytes of a stream of lines to readings; what cannot be read is counted, and the first of it is quoted."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.errors import BadInput
from labctl.recording.line_stream.layout import ROS_IMU, LineLayout, layout_of

#: A line is not longer than this, bytes: what is, is no line of readings.
LONGEST_LINE = 1 << 16
#: So many lines in a row whose time does not rise: the sender began anew.
BACKWARDS = 20
#: A damaged line is quoted up to here.
QUOTED = 80
_SEPARATORS = (",", ";", "\t")


@dataclass(frozen=True)
class DecodedLines:
    """n readings of some bytes."""

    columns: dict[str, NDArray[np.generic]]  #: of a recording, (n,) each, with t_s from the first line on
    damaged: int  #: lines that are no reading
    example: str  #: what is wrong with the first of them; "" without one

    def __len__(self) -> int:
        return len(self.columns.get("t_s", ()))


class LineDecoder:
    """Lines of one stream. The first line decides whether they are JSON or CSV, and names the values.

    `names`: of the values of a CSV line, where the lines have no header; `rate_hz`: readings per second, for lines
    without a time. Raises BadInput for names that do not suffice, as `layout_of` does.
    """

    def __init__(self, names: Sequence[str] = (), rate_hz: float | None = None) -> None:
        if rate_hz is not None and not (rate_hz > 0 and math.isfinite(rate_hz)):
            raise BadInput(f"--rate {rate_hz:g} Hz: give the readings per second, above 0")
        self._names = tuple(name.strip() for name in names)
        self._rate_hz = rate_hz
        self._layout: LineLayout | None = self._checked(layout_of(self._names)) if self._names else None
        self._separator = ""
        self._rest = b""
        self._first: dict[str, float] = {}
        self._last_s = -math.inf
        self._count = self._backwards = 0

    def feed(self, data: bytes) -> DecodedLines:
        """Return the readings of the lines that these bytes end; raises BadInput for lines that cannot be used at all.

        A line that is not whole yet is kept for the next bytes.
        """
        *lines, self._rest = (self._rest + data).split(b"\n")
        rows: list[list[float]] = []
        damaged, example = 0, ""
        if len(self._rest) > LONGEST_LINE:
            lines, self._rest = [*lines, self._rest], b""
        for line in lines:
            try:
                row = self._row(line)
            except _Damaged as error:
                damaged += 1
                example = example or f"{error}: {line[:QUOTED].decode('utf-8', errors='replace')!r}"
                continue
            if row is not None:
                rows.append(row)
        return DecodedLines(self._columns(rows), damaged, example)

    def _row(self, line: bytes) -> list[float] | None:
        """Return time and values of a line; None for a line that is no reading by intent: empty, comment, header."""
        text = line.decode("utf-8", errors="replace").strip().lstrip("\ufeff")
        if not text or text.startswith("#") or set(text) == {"-"}:  # `ros2 topic echo` puts --- between messages
            return None
        values = self._json(text) if text.startswith("{") else self._csv(text)
        if values is None:
            return None
        layout = self._layout
        assert layout is not None
        t_s = self._time(layout, values)
        row = [t_s]
        for field in layout.fields:
            value = field.factor * values.get(field.name, math.nan) + field.zero
            low, high = field.limits
            if not low <= value <= high:  # also true for NaN
                raise _Damaged(f"{field.name} is missing or no possible number")
            if field.target == "valid" and value not in (0.0, 1.0):
                raise _Damaged(f"{field.name} is neither 0 nor 1")
            row.append(value)
        self._last_s, self._count = t_s, self._count + 1
        return row

    def _json(self, text: str) -> Mapping[str, float]:
        try:
            document = json.loads(text)
        except (ValueError, RecursionError):
            raise _Damaged("no JSON") from None
        message = document.get("msg")
        values = dict(_flat(message if isinstance(message, dict) else document))  # rosbridge wraps a message
        if self._layout is None:
            self._layout = self._checked(layout_of(tuple(values)))
        return values

    def _csv(self, text: str) -> Mapping[str, float] | None:
        if not self._separator:
            self._separator = max(_SEPARATORS, key=text.count)
        words = [word.strip().strip('"') for word in text.split(self._separator)]
        numbers = [_number(word) for word in words]
        if self._layout is None:
            names = ROS_IMU if len(words) == len(ROS_IMU) and not math.isnan(numbers[0]) else words
            if names is words and not all(map(math.isnan, numbers)):
                raise BadInput(
                    f"the first line of the stream is no header: {text[:QUOTED]!r}; name its values with --columns, "
                    "such as t_s,gyro_x,gyro_y,gyro_z,accel_x_g,accel_y_g,accel_z_g"
                )
            self._layout = self._checked(layout_of(names))
        names = self._layout.names
        if tuple(words) == names:
            return None
        if len(words) != len(names):
            raise _Damaged(f"{len(words)} values where {len(names)} are expected")
        return dict(zip(names, numbers, strict=True))

    def _checked(self, layout: LineLayout) -> LineLayout:
        if not layout.time and self._rate_hz is None:
            raise BadInput(
                "the lines have no time; add a column t_s (s) to them, or state their number per second with --rate"
            )
        return layout

    def _time(self, layout: LineLayout, values: Mapping[str, float]) -> float:
        if not layout.time:
            return self._count / (self._rate_hz or 1.0)
        given = {name: values.get(name, math.nan) for name in layout.time}
        if not all(map(math.isfinite, given.values())):
            raise _Damaged("the time is missing")
        if not self._first:
            self._first = given
        t_s = sum((value - self._first[name]) * layout.time[name] for name, value in given.items())
        if t_s > self._last_s:
            self._backwards = 0
            return t_s
        self._backwards += 1
        if self._backwards >= BACKWARDS:
            raise BadInput(
                f"the time of the lines went back from {self._last_s:.3f} s to {t_s:.3f} s and stays there: the sender "
                "has begun anew; start the calibration again"
            )
        raise _Damaged(f"the time {t_s:.6f} s does not follow {self._last_s:.6f} s")

    def _columns(self, rows: list[list[float]]) -> dict[str, NDArray[np.generic]]:
        if self._layout is None:
            return {}
        targets = ["t_s", *(field.target for field in self._layout.fields)]
        table = np.array(rows, dtype=np.float64).reshape(len(rows), len(targets))
        return {
            target: table[:, k].astype(np.int64 if target == "valid" else np.float64)
            for k, target in enumerate(targets)
        }


class _Damaged(Exception):
    """A line that is no reading."""


def _number(word: str) -> float:
    try:
        return float(word)
    except ValueError:
        return math.nan


def _flat(document: Mapping[str, object], above: str = "") -> Iterator[tuple[str, float]]:
    """Yield the numbers of nested objects by their path, such as angular_velocity.x."""
    for name, value in document.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{above}{name}.")
        elif isinstance(value, int | float):
            yield above + name, float(value)

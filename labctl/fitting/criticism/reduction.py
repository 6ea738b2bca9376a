"""A recording compressed for criticism: a few numbers per data set that keep what its mean throws away.

Within each data set an orthonormal basis is built from a constant, time, a start transient and waves in the table
angle; the readings' coordinates in it are kept. For white noise this loses nothing that an effect of the catalogue
could use. Slow regressors are evaluated at a few nodes per data set and brought to the same coordinates.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.data.channels import Carrier, Channels, body_rates, channels_of
from labctl.fitting.data.earth import up_rate_dps
from labctl.fitting.data.static_record import StaticRecord
from labctl.fitting.data.temperature_channel import with_temperature
from labctl.fitting.data.temperature_history import history_of
from labctl.fitting.effects import Column
from labctl.fitting.numeric.arrays import Array
from labctl.recording import Recording, RecordingInfo, to_points
from labctl.recording.points import dataset_starts, pieces

#: Where slow regressors are evaluated within a data set.
NODES = 12
#: Readings faster than this are averaged down first.
FASTEST_HZ = 10.0
START_TAU_S = 4.0
#: Waves per turn of the table: once, twice, and the reduction's.
WAVES = (1, 2, 4)
#: Lines of the stepper's electrical cycle, with and without the reduction. They are far larger than what is looked for:
#: they are taken out of every other coordinate, and not looked at themselves.
STEP_LINES = (200, 50)
#: Where sampling folds a line onto a constant it cannot be told from one, and stays.
STEADY = 0.3
#: A basis function that is less than this apart from those before it is left out: slow rates turn only degrees.
APART = 0.1
#: A reading further than this many robust standard deviations from its data set's middle is left out, and counted ...
OUTLIER = 6.0
#: ... or from what nine tenths of them keep within, where a line of the steps takes a few values only; ...
BEYOND = 3.0
#: ... unless there are more of them than this share: then it is how the data set is.
FEW = 0.05

#: A data set longer than this many usual ones is taken in pieces.
LONGEST = 4

KINDS = ("mean", "slope", "start", *(f"{wave}{n}" for n in WAVES for wave in ("cos", "sin")))


@dataclass(frozen=True)
class ReducedRecording:
    """m data sets in R coordinates each; coordinates are scaled so that the first is the mean, in deg/s."""

    info: RecordingInfo
    nodes: Channels  #: (m * B) rows, those of one data set together
    weights: NDArray[np.float64]  #: (R, m, B): coordinate k of a slow regressor is the sum of weights x nodes
    waves: Mapping[Carrier, NDArray[np.float64]]  #: (R, m) coordinates of a wave in the table angle
    output: Mapping[str, NDArray[np.float64]]  #: axis -> (R, m) coordinates of the output, deg/s
    present: NDArray[np.bool_]  #: (R, m): which coordinates there are
    white_var: Mapping[str, Array] | None  #: axis -> (m,) variance of the mean from white noise
    dataset: NDArray[np.int64]
    left_out: int = 0  #: readings taken for outliers
    static: StaticRecord | None = None  #: where it is used

    def __len__(self) -> int:
        return self.present.shape[1]

    def instability_dps(self, axis: str) -> float | None:
        """Return the bias instability that a static record shows for an axis, deg/s; None without one."""
        return self.static.instability_dps(axis) if self.static is not None else None

    def at_sets(self, values: Array) -> Array:
        """Return node values (m * B,) averaged over each data set, (m,)."""
        return np.asarray(values.reshape(len(self), -1).mean(axis=1))

    def rows(self, column: Column) -> NDArray[np.float64]:
        """Return the coordinates of a regressor, (R, m)."""
        if column.carrier is not None and column.carrier in self.waves:
            return self.at_sets(column.values) * self.waves[column.carrier]
        values = column.mean(self.nodes)
        return np.einsum("rmb,mb->rm", self.weights, values.reshape(len(self), -1))

    def rows_of(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the coordinates of slow regressors (m * B, k), as (R, m, k)."""
        k = values.shape[1]
        return np.einsum("rmb,mbk->rmk", self.weights, values.reshape(len(self), -1, k), optimize=True)


def reduce_recording(recording: Recording, *, outliers: bool = True) -> ReducedRecording:
    """Return a recording compressed; points have their means only. Without `outliers` every reading counts.

    Raises NotEnoughData where nothing says how warm the unit was.
    """
    recording = with_temperature(recording)
    return _from_samples(recording, outliers) if recording.info.kind == "samples" else _from_points(recording)


def _from_points(recording: Recording) -> ReducedRecording:
    points = to_points(recording)
    channels = channels_of(points, up_rate_dps(points.info))
    m = len(points)
    white = _white_of_points(points)
    dataset = np.asarray(points.columns.get("dataset", np.arange(1, m + 1)), dtype=np.int64)
    return ReducedRecording(
        points.info, channels, np.ones((1, m, 1)), {}, {a: points.gyro_dps(a)[None, :] for a in points.info.axes},
        np.ones((1, m), dtype=bool), white, dataset,
    )  # fmt: skip


def _white_of_points(points: Recording) -> dict[str, Array] | None:
    found: dict[str, Array] = {}
    for axis in points.info.axes:
        spread = points.columns.get(f"gyro_{axis}_white_std", points.columns.get(f"gyro_{axis}_std"))
        if spread is None or "n" not in points.columns:
            return None
        scale = abs(points.info.output[axis].scale) if axis in points.info.output else 1.0
        level = float(np.sqrt(np.median((np.asarray(spread, dtype=np.float64) / scale) ** 2)))
        if not level > 0:
            return None
        found[axis] = level**2 / np.maximum(np.asarray(points.columns["n"], dtype=np.float64), 1.0)
    return found


@dataclass(frozen=True)
class _Padded:
    """Readings as (m, n) with zeros where there is none."""

    there: NDArray[np.float64]
    index: NDArray[np.int64]

    def of(self, values: Array) -> NDArray[np.float64]:
        """Return a column (rows,) as (m, n)."""
        return np.where(self.there > 0, values[self.index], 0.0)


def _pad(dataset: NDArray[np.int64]) -> _Padded:
    starts = dataset_starts(dataset)
    counts = np.diff(np.append(starts, len(dataset)))
    offset = np.arange(int(counts.max()))
    there = offset[None, :] < counts[:, None]
    return _Padded(there.astype(np.float64), np.where(there, starts[:, None] + offset, 0))


def _pieces(columns: Mapping[str, NDArray[Any]]) -> NDArray[np.int64]:
    """Return labels (n,) that change with the row of the fit, and within one that is far longer than usual.

    A static record at one temperature is one row of the fit. Here it would need room, and would be a single mean, for
    what drifts all the while.
    """
    rows = pieces(columns)
    starts = dataset_starts(rows)
    counts = np.diff(np.append(starts, len(rows)))
    parts = -(-counts // max(int(LONGEST * np.median(counts)), 1))
    ordinal = np.arange(len(rows)) - np.repeat(starts, counts)
    first = np.concatenate([[0], np.cumsum(parts)[:-1]])
    return np.repeat(first, counts) + ordinal * np.repeat(parts, counts) // np.repeat(counts, counts)


def _decimated(
    recording: Recording,
) -> tuple[dict[str, NDArray[np.float64]], NDArray[np.int64], dict[str, NDArray[Any]]]:
    """Return valid readings averaged down to `FASTEST_HZ`: numbers, their data sets, and texts."""
    columns = recording.columns
    valid = np.asarray(columns["valid"]) != 0 if "valid" in columns else np.ones(len(recording), dtype=bool)
    dataset = np.asarray(columns["dataset"], dtype=np.int64)[valid]
    numbers = {
        name: np.asarray(values, dtype=np.float64)[valid]
        for name, values in columns.items()
        if name not in {"valid", "dataset"} and values.dtype.kind in "fiu"
    }
    texts = {name: np.asarray(v)[valid] for name, v in columns.items() if v.dtype.kind not in "fiu"}
    for axis in recording.info.axes:
        numbers[f"gyro_{axis}"] = recording.gyro_dps(axis)[valid]
    starts = dataset_starts(dataset)
    t_s = numbers.get("t_s", np.arange(len(dataset), dtype=np.float64))
    spacing = float(np.median(np.diff(t_s[: min(len(t_s), 5000)]))) if len(t_s) > 1 else 0.1
    every = max(round(1.0 / (FASTEST_HZ * max(spacing, 1e-6))), 1)
    if every > 1:
        ordinal = np.arange(len(dataset)) - np.repeat(starts, np.diff(np.append(starts, len(dataset))))
        blocks = dataset_starts(dataset * (int(ordinal.max()) // every + 2) + ordinal // every)
        counts = np.diff(np.append(blocks, len(dataset)))
        numbers = {name: np.add.reduceat(values, blocks) / counts for name, values in numbers.items()}
        texts = {name: values[blocks] for name, values in texts.items()}
        dataset = dataset[blocks]
    return numbers, dataset, texts


def thin(recording: Recording) -> Recording:
    """Return a recording's valid readings averaged down to what criticism needs."""
    numbers, dataset, texts = _decimated(recording)
    for axis in recording.info.axes:
        unit = recording.info.output.get(axis)
        if unit is not None:
            numbers[f"gyro_{axis}"] = unit.offset + unit.scale * numbers[f"gyro_{axis}"]
    for name in ("run", "mounting"):
        if name in numbers:
            texts[name] = np.rint(numbers.pop(name)).astype(np.int64)
    return Recording(recording.info, {"dataset": dataset, **numbers, **texts}, recording.environment)


def _from_samples(recording: Recording, outliers: bool) -> ReducedRecording:
    numbers, dataset, texts = _decimated(recording)
    padded = _pad(_pieces({"dataset": dataset, **numbers}))
    m = len(padded.there)
    begin = padded.index[:, 0]
    t_s = numbers.get("t_s", np.arange(len(dataset), dtype=np.float64) / FASTEST_HZ)
    since = padded.of(t_s - t_s[begin].repeat(padded.there.sum(axis=1).astype(int)))
    angle = np.deg2rad(padded.of(numbers["table_angle_deg"])) if "table_angle_deg" in numbers else None
    axes: tuple[str, ...] = recording.info.axes
    outputs = {axis: padded.of(numbers[f"gyro_{axis}"]) for axis in axes}
    there = padded.there
    for axis in axes if outliers else ():
        there = there * _inside(outputs[axis], padded.there)
    # The steps' lines need a turn, from wherever: both of their waves are taken out.
    turned = angle if angle is not None else np.deg2rad(padded.of(numbers["table_rate_dps"])) * since
    basis, present = _basis(there, since, turned, angle)
    count = np.maximum(there.sum(axis=1), 1.0)
    basis /= np.sqrt(count)[None, :, None]
    nodes, weights = _nodes(recording, numbers, texts, padded, there, since, basis)
    waves = {}
    if angle is not None:
        for k in WAVES:
            waves["cos", k] = np.einsum("rmn,mn->rm", basis, np.cos(k * angle))
            waves["sin", k] = np.einsum("rmn,mn->rm", basis, np.sin(k * angle))
    coordinates = {axis: np.einsum("rmn,mn->rm", basis, outputs[axis]) for axis in axes}
    white = {axis: np.full(m, _white_level(outputs[axis], there) ** 2) / count for axis in axes}
    return ReducedRecording(
        recording.info, nodes, weights, waves, coordinates, present, white, dataset[begin],
        int(padded.there.sum() - there.sum()),
    )  # fmt: skip


def _inside(values: NDArray[np.float64], there: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return 1 where a reading is no outlier of its data set, (m, n)."""
    masked = np.where(there > 0, values, np.nan)
    middle = np.nanmedian(masked, axis=1, keepdims=True)
    spread = 1.4826 * np.nanmedian(np.abs(masked - middle), axis=1, keepdims=True)
    most = np.nanquantile(np.abs(masked - middle), 1.0 - 2 * FEW, axis=1, keepdims=True)
    far = (np.abs(values - middle) > np.maximum(OUTLIER * spread, BEYOND * most)) & (there > 0)
    few = far.sum(axis=1, keepdims=True) <= FEW * there.sum(axis=1, keepdims=True)
    return np.where(far & few, 0.0, 1.0)


def _basis(
    there: NDArray[np.float64], since: NDArray[np.float64], turned: NDArray[np.float64],
    angle: NDArray[np.float64] | None,
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:  # fmt: skip
    """Return orthonormal functions, (R, m, n), and which exist in which data set, (R, m).

    `turned` is how far the table turned, `angle` where it stands, where that was recorded, rad.
    """
    wanted = [there, since, np.exp(-since / START_TAU_S)]
    lines = [wave(k * turned) for k in STEP_LINES for wave in (np.cos, np.sin)]
    if angle is not None:
        wanted += [wave(k * angle) for k in WAVES for wave in (np.cos, np.sin)]
    functions = [*lines, *wanted]
    found = np.zeros((len(functions), *there.shape))
    present = np.zeros((len(functions), len(there)), dtype=bool)
    count = np.maximum(there.sum(axis=1), 1.0)
    for k, function in enumerate(functions):
        values = function * there
        size = np.sqrt((values**2).sum(axis=1))
        steady = np.abs(values.sum(axis=1)) / np.maximum(size * np.sqrt(count), 1e-300)
        for _ in range(2):  # twice is enough (Kahan)
            inner = np.einsum("rmn,mn->rm", found[:k], values)
            values = values - np.einsum("rm,rmn->mn", inner, found[:k])
        left = np.sqrt((values**2).sum(axis=1))
        present[k] = left > np.maximum(APART * size, 1e-9)
        if k < len(lines):
            present[k] &= steady < STEADY
        found[k] = np.where(present[k][:, None], values / np.maximum(left, 1e-300)[:, None], 0.0)
    return found[len(lines) :], present[len(lines) :]


def _nodes(
    recording: Recording, numbers: Mapping[str, Array], texts: Mapping[str, NDArray[Any]], padded: _Padded,
    there: NDArray[np.float64], since: NDArray[np.float64], basis: NDArray[np.float64],
) -> tuple[Channels, NDArray[np.float64]]:  # fmt: skip
    """Return the channels at the nodes, (m * B,), and the weights (R, m, B) that bring them to coordinates."""
    m, n = there.shape
    edges = np.linspace(0, n, min(NODES, n) + 1).astype(np.int64)[:-1]
    inside = np.add.reduceat(there, edges, axis=1)

    def averaged(values: NDArray[np.float64]) -> NDArray[np.float64]:
        sums = np.add.reduceat(values * there, edges, axis=1)
        whole = sums.sum(axis=1, keepdims=True) / np.maximum(inside.sum(axis=1, keepdims=True), 1.0)
        return np.where(inside > 0, sums / np.maximum(inside, 1.0), whole)

    weights = np.add.reduceat(basis, edges, axis=2)
    bins = len(edges)
    columns: dict[str, NDArray[np.float64]] = {}
    for name, values in numbers.items():
        if not name.startswith("gyro_"):
            columns[name] = averaged(padded.of(values)).ravel()
    begin = padded.index[:, 0]
    for name in ("run", "mounting"):
        if name in columns:
            columns[name] = np.repeat(numbers[name][begin], bins)
    rate = numbers["table_rate_dps"][begin]
    columns["table_rate_dps"] = np.repeat(rate, bins)
    columns["previous_rate_dps"] = np.repeat(np.concatenate([[0.0], rate[:-1]]), bins)
    spacing = float(np.median(np.diff(since[0][: int(padded.there[0].sum())]))) if n > 1 else 1.0 / FASTEST_HZ
    middle = averaged(since)
    length = np.maximum(inside, 1.0) * spacing
    columns["since_begin_s"] = np.maximum(middle - length / 2, 0.0).ravel()
    columns["duration_s"] = length.ravel()
    position = texts["position"][begin] if "position" in texts else np.full(m, recording.info.axes[0])
    text: dict[str, NDArray[np.str_]] = {"position": np.repeat(np.asarray(position, dtype=np.str_), bins)}
    true = columns["table_rate_dps"] + up_rate_dps(recording.info)
    channels = Channels({**columns, **text}, body_rates(true, text["position"]), history_of(recording))
    return channels, weights


def _white_level(values: NDArray[np.float64], there: NDArray[np.float64]) -> float:
    """Return the white standard deviation of one reading: the median over data sets and frequencies."""
    full = there.all(axis=1) if there.all(axis=1).sum() >= max(8, len(there) // 10) else np.ones(len(there), dtype=bool)
    chosen, mask = values[full], there[full]
    middle = (chosen * mask).sum(axis=1, keepdims=True) / np.maximum(mask.sum(axis=1, keepdims=True), 1.0)
    window = np.hanning(chosen.shape[1])[None, :]
    residual = np.where(mask > 0, chosen - middle, 0.0) * window
    power = np.abs(np.fft.rfft(residual, axis=1)[:, 2:-1]) ** 2 / np.sum(window**2)
    per_set = np.median(power, axis=1) / np.log(2.0)
    return float(np.sqrt(np.median(per_set)))

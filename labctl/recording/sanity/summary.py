"""Summary of a recording's data sets: the few numbers of each that the checks use.

The readings are needed once, data set by data set; what is kept has one row per data set.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from labctl.recording.columns import VERIFICATION
from labctl.recording.info import RecordingInfo
from labctl.recording.motions.turn_means import rates_as_turned
from labctl.recording.motions.turns import USUAL_U_DEG
from labctl.recording.points import dataset_starts
from labctl.recording.positions import Position
from labctl.recording.quantisation import codes_of
from labctl.recording.recording import Columns, Recording, temperature_of
from labctl.recording.verification import is_marked

#: Blocks of a data set between which its level is compared, and readings that one block needs.
LEVEL_BLOCKS, MIN_PER_BLOCK, MIN_BLOCKS = 16, 2, 8
#: A change of level is sudden where the blocks on either side scatter by less than this many noises of a block's
#: mean, or than this share of the change: a creeping output does not.
STILL_NOISES, STILL_SHARE = 3.0, 0.01
#: A change of level is this many times the scatter on either side.
CHANGE_RATIO = 8.0
#: Blocks over which an output at rest may wander, and the decays, in blocks, that count as start-up.
WANDER_BLOCKS, DECAYS = 32, (1.0, 4.0)


class Change(NamedTuple):
    """A sudden change of level within a data set: how large, deg/s, and at which of its readings."""

    size: float
    row: int


NO_CHANGE = Change(0.0, -1)


def noise_of_reading(values: NDArray[np.float64]) -> float:
    """Return the standard deviation of one reading of (n,) from successive differences; level changes do not count."""
    if len(values) < 2:
        return 0.0
    steps = np.abs(np.diff(values))
    robust = 1.4826 * float(np.median(steps))
    return (robust if robust > 0 else float(np.sqrt(np.mean(np.minimum(steps, _usual_step(steps)) ** 2)))) / np.sqrt(2)


def _usual_step(steps: NDArray[np.float64]) -> float:
    return float(np.median(steps[steps > 0])) if np.any(steps > 0) else 0.0


def block_means(values: NDArray[np.float64], blocks: int) -> NDArray[np.float64]:
    """Return the means of (n,) values in `blocks` pieces of nearly equal length, (blocks,)."""
    edges = np.linspace(0, len(values), blocks + 1).astype(np.int64)
    return np.asarray(np.add.reduceat(values, edges[:-1]) / np.diff(edges))


def level_change(values: NDArray[np.float64], noise: float) -> Change:
    """Return the largest sudden change of level of readings (n,); none where they creep, wander or stay.

    The block in which the change falls is left out. The first block alone is no level: a unit may creep to its rate.
    """
    blocks = min(LEVEL_BLOCKS, len(values) // MIN_PER_BLOCK)
    if blocks < MIN_BLOCKS:
        return NO_CHANGE
    means = block_means(values, blocks)
    noise_of_block = noise / np.sqrt(len(values) / blocks)
    at = np.arange(2, blocks)
    left_columns, right = (
        np.concatenate([at, at[:-1]]),
        np.concatenate([at, at[:-1] + 1]),
    )  # with and without a block between
    sums, squares = (np.concatenate([[0.0], np.cumsum((means - means[0]) ** power)]) for power in (1, 2))
    after = blocks - right
    low, high = sums[left_columns] / left_columns, (sums[-1] - sums[right]) / after
    scatter = squares[left_columns] - left_columns * low**2 + squares[-1] - squares[right] - after * high**2
    rests = np.sqrt(np.maximum(scatter, 0.0) / (left_columns + after - 2))
    k = int(np.argmin(rests))
    best_rest = float(rests[k])
    best = Change(float(high[k] - low[k]), int((left_columns[k] + right[k]) / 2 * len(values) / blocks))
    still = best_rest <= max(STILL_NOISES * noise_of_block, STILL_SHARE * abs(best.size))
    large = abs(best.size) > CHANGE_RATIO * max(best_rest, noise_of_block)
    return best if still and large else NO_CHANGE


def wander(values: NDArray[np.float64], temperature_c: NDArray[np.float64] | None, noise: float) -> float:
    """Return the root mean square by which block means of readings (n,) move, beyond what noise explains.

    A cubic in time and in temperature, and decays after the start, do not count: those are drift.
    """
    blocks = min(WANDER_BLOCKS, len(values) // MIN_PER_BLOCK)
    if blocks < WANDER_BLOCKS // 2:
        return 0.0
    means = block_means(values, blocks)
    at = np.linspace(-1.0, 1.0, blocks)
    columns = [at**power for power in range(4)] + [np.exp(-np.arange(blocks) / decay) for decay in DECAYS]
    if temperature_c is not None:
        block_c = block_means(temperature_c, blocks)
        span = float(np.ptp(block_c))
        if span > 0.1:
            columns += [((block_c - block_c.mean()) / span) ** power for power in (1, 2, 3)]
    design = np.column_stack(columns)
    q, _ = np.linalg.qr(design)
    residual = means - q @ (q.T @ means)
    square = float(np.sum(residual**2)) / (blocks - design.shape[1])
    return float(np.sqrt(max(square - noise**2 * blocks / len(values), 0.0)))


#: Stretches of a data set that are inspected, and readings of each.
STRETCHES, READINGS = 500, 4
#: An output may be late by this long, s, and this many readings early.
LATEST_S, EARLIEST = 0.25, 10
#: The shortest lag is taken at which output and rate agree to this share of their best agreement.
NEARLY = 0.95


def stretches(n: int) -> list[slice]:
    """Return evenly spread stretches of n readings, all of them where they are few."""
    number = max(min(STRETCHES, n // READINGS), 1)
    begins = np.linspace(0, max(n - READINGS, 0), number).astype(np.int64)
    return [slice(int(begin), int(min(begin + READINGS, n))) for begin in begins]


def lag_of(rate_dps: NDArray[np.float64], output: NDArray[np.float64], step_s: float) -> int:
    """Return by how many readings an output (n,) is late against the rate (n,); it may have the other sign.

    A delay must not look like a wrong sign or scale: at 10 Hz 50 ms are half a period.
    """
    n = len(rate_dps)
    rate, values = rate_dps - rate_dps.mean(), output - output.mean()
    if n < 4 * READINGS or not np.any(rate) or not np.any(values):
        return 0
    latest = int(min(LATEST_S / max(step_s, 1e-9), n // 4))
    lags = np.arange(-min(EARLIEST, n // 4), latest + 1)
    spectrum = np.fft.rfft(values, 2 * n) * np.fft.rfft(rate, 2 * n).conj()
    agree = np.abs(np.fft.irfft(spectrum, 2 * n)[lags])  # by lag: a negative one counts from the end
    good = lags[agree >= NEARLY * agree.max()]
    return int(good[np.argmin(np.abs(good))])


#: Time steps longer than this many usual ones, and than so many seconds, are a gap.
GAP_STEPS, GAP_S = 5.0, 0.5
_NONE: NDArray[np.float64] = np.zeros(0)


@dataclass(frozen=True)
class Summary:
    """m data sets of one recording; rates in deg/s, NaN where the recording does not say."""

    info: RecordingInfo
    columns: Mapping[str, NDArray[np.generic]]  #: name -> (m,)

    def __len__(self) -> int:
        return len(self.columns["dataset"])

    def __getitem__(self, name: str) -> NDArray[np.generic]:
        return self.columns[name]

    def of_axis(self, name: str, axis: str) -> NDArray[np.float64]:
        """Return a figure of one output axis, (m,)."""
        return np.asarray(self.columns[f"{name}_{axis}"], dtype=np.float64)

    def take(self, rows: NDArray[np.bool_] | NDArray[np.int64]) -> Summary:
        """Return the summary of some data sets, by index or mask."""
        return Summary(self.info, {name: values[rows] for name, values in self.columns.items()})


def summarise(recording: Recording) -> Summary:
    """Return the summary of a recording of readings or of means; empty for a table of coefficients.

    Also of a recording in poses, of which no rate is known: its fit judges rests and turns itself.
    """
    if recording.info.kind == "coefficients" or recording.info.motion == "poses" or len(recording) == 0:
        return Summary(recording.info, {"dataset": np.zeros(0, dtype=np.int64)})
    return _of_readings(recording) if recording.info.kind == "samples" else _of_means(recording)


def joined(info: RecordingInfo, parts: Sequence[Summary]) -> Summary:
    """Return the summaries of parts of a recording, in order, as one."""
    not_empty = [part for part in parts if len(part)]
    if not not_empty:
        return Summary(info, {"dataset": np.zeros(0, dtype=np.int64)})
    return Summary(info, {name: np.concatenate([part[name] for part in not_empty]) for name in not_empty[0].columns})


def _of_readings(recording: Recording) -> Summary:
    columns = recording.columns
    valid = np.asarray(columns["valid"]) != 0 if "valid" in columns else np.ones(len(recording), dtype=bool)
    rows = {name: np.asarray(values)[valid] for name, values in columns.items()}
    if not valid.any():
        return Summary(recording.info, {"dataset": np.zeros(0, dtype=np.int64)})
    outputs: dict[str, NDArray[np.float64]] = {a: recording.gyro_dps(a)[valid] for a in recording.info.axes}
    starts = dataset_starts(np.asarray(rows["dataset"], dtype=np.int64))
    if recording.info.motion == "turns":
        rows["rate_as_turned_dps"] = rates_as_turned(recording)[valid]
    whole = [
        slice(int(begin), int(end))
        for begin, end in zip(starts, np.append(starts[1:], len(rows["dataset"])), strict=True)
    ]
    if recording.info.motion == "profile":
        sets = [one for in_piece in whole for one in _stretches(recording.info, rows, outputs, in_piece)]
    else:
        sets = [_one_set(recording.info, rows, outputs, in_piece) for in_piece in whole]
    return Summary(recording.info, {name: np.array([one[name] for one in sets]) for name in sets[0]})


def _one_set(
    info: RecordingInfo, rows: Columns, outputs: Mapping[str, NDArray[np.float64]], set_rows: slice
) -> dict[str, Any]:
    t_s = np.asarray(rows["t_s"], dtype=np.float64)[set_rows]
    rate = (
        np.asarray(rows["table_rate_dps"], dtype=np.float64)[set_rows]
        if "table_rate_dps" in rows
        else np.zeros(len(t_s))
    )
    temperature_c = temperature_of(rows)
    summary_row: dict[str, Any] = {
        **_place(info, rows, set_rows.start),
        "n": len(rate),
        "table_rate_dps": float(rate.mean()),
        "rate_low_dps": float(rate.min()),
        "rate_high_dps": float(rate.max()),
        **_temperatures(_NONE if temperature_c is None else temperature_c[set_rows]),
        **_times(t_s),
        "turning_dps": _turning(rows, set_rows, t_s),
        "turning_u_dps": float(rows["encoder_rate_u_dps"][set_rows.start]) if "encoder_rate_u_dps" in rows else np.nan,
    }
    if info.motion == "turns":
        as_turned = np.asarray(rows["rate_as_turned_dps"], dtype=np.float64)[set_rows]
        summary_row |= {**_turn(rows, set_rows.start), "duration_s": float(t_s[-1] - t_s[0])}
        summary_row |= {"rate_low_dps": float(as_turned.min()), "rate_high_dps": float(as_turned.max())}
    for axis, values in outputs.items():
        figures = _output(
            values[set_rows], None if temperature_c is None else temperature_c[set_rows], at_rest=not rate.any()
        )
        summary_row |= {f"{name}_{axis}": value for name, value in figures.items()}
    return summary_row


def _stretches(
    info: RecordingInfo, rows: Columns, outputs: Mapping[str, NDArray[np.float64]], all_rows: slice
) -> list[dict[str, Any]]:
    """Return stretches of a data set whose rate changes, with the output as if it were not late."""
    rate = np.asarray(rows["table_rate_dps"], dtype=np.float64)[all_rows]
    values_of = {name: values[all_rows] for name, values in rows.items()}
    place = _place(info, values_of, 0)
    axis = Position.of(place["position"]).axis
    steps = np.diff(np.asarray(values_of["t_s"], dtype=np.float64))
    lag = lag_of(
        rate, outputs.get(axis, next(iter(outputs.values())))[all_rows], float(np.median(steps)) if len(steps) else 1.0
    )
    n = len(rate) - abs(lag)
    early, late = max(-lag, 0), max(lag, 0)
    values_of = {name: values[early : early + n] for name, values in values_of.items()}
    moved = {name: values[all_rows][late : late + n] for name, values in outputs.items()}
    ends = {"rate_low_dps": float(rate.min()), "rate_high_dps": float(rate.max())}
    return [{**_one_set(info, values_of, moved, part), **ends} for part in stretches(n)]


def _place(info: RecordingInfo, rows: Columns, row: int) -> dict[str, Any]:
    return {
        "dataset": int(rows["dataset"][row]),
        "position": str(rows["position"][row]) if "position" in rows else info.axes[0],
        "run": int(rows["run"][row]) if "run" in rows else 1,
        VERIFICATION: bool(rows[VERIFICATION][row]) if VERIFICATION in rows else False,
    }


def _turn(columns: Columns, row: int) -> dict[str, Any]:
    """Return what is said of the turn of the data set that begins at a row."""
    turn, has_u = float(columns["turn_deg"][row]), "turn_u_deg" in columns
    u_deg = float(columns["turn_u_deg"][row]) if has_u else USUAL_U_DEG
    return {"turn_deg": turn, "turn_u_deg": u_deg if turn else 0.0, "turn_u_known": has_u}


def _temperatures(temperature_c: NDArray[np.float64]) -> dict[str, float]:
    if len(temperature_c) == 0:
        return dict.fromkeys(("temperature_c", "temperature_low_c", "temperature_high_c"), np.nan)
    return {
        "temperature_c": float(temperature_c.mean()),
        "temperature_low_c": float(temperature_c.min()),
        "temperature_high_c": float(temperature_c.max()),
    }


def _times(t_s: NDArray[np.float64]) -> dict[str, float]:
    steps = np.diff(t_s)
    usual = float(np.median(steps)) if len(steps) else np.nan
    gaps = steps[steps > max(GAP_STEPS * usual, GAP_S)] if len(steps) else steps
    return {
        "t_begin_s": float(t_s[0]), "t_end_s": float(t_s[-1]), "step_s": usual,
        "gap_s": float(gaps.max(initial=0.0)), "lost_s": float(np.sum(gaps - usual)) if len(gaps) else 0.0,
    }  # fmt: skip


def _turning(rows: Columns, set_rows: slice, t_s: NDArray[np.float64]) -> float:
    """Return the rate at which the logged table angle turns over the data set, degrees per unit of `t_s`."""
    if "table_angle_deg" not in rows or len(t_s) < 2 or t_s[-1] <= t_s[0]:
        return np.nan
    angle = np.asarray(rows["table_angle_deg"], dtype=np.float64)[set_rows]
    return float((angle[-1] - angle[0]) / (t_s[-1] - t_s[0]))


def _encoder(rows: Columns, m: int) -> dict[str, NDArray[np.generic]]:
    """Return the rate by the table's encoder of m means, deg/s, and its standard uncertainty; NaN where not known."""
    names = {"turning_dps": "encoder_rate_dps", "turning_u_dps": "encoder_rate_u_dps"}
    return {name: np.asarray(rows.get(column, np.full(m, np.nan)), dtype=np.float64) for name, column in names.items()}


def _output(
    values: NDArray[np.float64], temperature_c: NDArray[np.float64] | None, *, at_rest: bool
) -> dict[str, float]:
    codes = codes_of(values)
    noise = min(noise_of_reading(values), codes.std)
    change = level_change(values, noise)
    return {
        "mean": float(values.mean()), "std": codes.std, "noise": noise,
        "code": codes.code, "code_step": codes.step, "white_std": codes.white_std,
        "wander": wander(values, temperature_c, noise) if at_rest else np.nan,
        "change": change.size, "change_row": change.row,
    }  # fmt: skip


def _of_means(recording: Recording) -> Summary:
    rows, m, info = recording.columns, len(recording), recording.info
    rate = np.asarray(rows["table_rate_dps"], dtype=np.float64)
    temperature_c = temperature_of(rows)
    temperature_c = np.full(m, np.nan) if temperature_c is None else temperature_c
    t_s = np.asarray(rows["t_s"], dtype=np.float64) if "t_s" in rows else np.full(m, np.nan)
    unknown = np.full(m, np.nan)
    columns: dict[str, NDArray[np.generic]] = {
        "dataset": np.asarray(rows["dataset"]) if "dataset" in rows else np.arange(1, m + 1),
        "position": np.asarray(rows["position"]).astype(np.str_) if "position" in rows else np.full(m, info.axes[0]),
        "run": np.asarray(rows["run"]) if "run" in rows else np.ones(m, dtype=np.int64),
        "n": np.asarray(rows["n"]) if "n" in rows else np.ones(m, dtype=np.int64),
        VERIFICATION: is_marked(recording),
        "table_rate_dps": rate, "rate_low_dps": rate, "rate_high_dps": rate,
        "temperature_c": temperature_c, "temperature_low_c": temperature_c, "temperature_high_c": temperature_c,
        "t_begin_s": t_s, "t_end_s": t_s, **_encoder(rows, m),
        **dict.fromkeys(("step_s", "gap_s", "lost_s"), unknown),
    }  # fmt: skip
    if info.motion == "turns":
        turns = [_turn(rows, row) for row in range(m)]
        columns |= {name: np.array([turn[name] for turn in turns]) for name in turns[0]}
        columns["duration_s"] = np.asarray(rows["duration_s"], dtype=np.float64)
    for axis in info.axes:
        output = info.output.get(axis)
        scale = abs(output.scale) if output else 1.0
        std = np.asarray(rows[f"gyro_{axis}_std"], dtype=np.float64) / scale if f"gyro_{axis}_std" in rows else unknown
        figures = {
            "mean": recording.gyro_dps(axis),
            "std": std,
            "noise": std,
            "white_std": std,
            "change": np.full(m, NO_CHANGE.size),
        }
        figures |= {"change_row": np.full(m, NO_CHANGE.row), **dict.fromkeys(("wander", "code", "code_step"), unknown)}
        columns |= {f"{name}_{axis}": values for name, values in figures.items()}
    return Summary(info, columns)

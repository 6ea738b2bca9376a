"""Readings that do not change: an output that stays at one value, rows that are written again."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from labctl.recording.sanity.finding import Finding
from labctl.recording.sanity.readings.series import Array, Marked, Rows, Series, gain_of, rows_in_words, runs, spread_of

#: The probability, for a whole channel, of a run of equal readings that is called frozen; and its least length.
CHANCE, MIN_RUN = 1e-6, 20
#: Runs up to this length tell how often a reading equals the one before. An output is coarse whose step is above this
#: many noises: it stays at a code by itself.
USUAL_RUN, COARSE_NOISES = 50, 0.8
#: A coarse output is frozen where the table's rate would move it by so many steps of its code.
COARSE_STEPS = 5.0
#: An output frozen in this share of the readings, or in most of a data set, makes a fit certainly wrong.
CERTAIN_SHARE, MAX_OF_SET = 0.1, 0.9
#: An output comes in coarse steps from so many times its noise on; a value is a multiple of a step within this share.
COARSE_LATTICE, ON_LATTICE = 1.9, 0.02
#: Rows are written again where this share more of them equal the row before than equal that three rows before.
REPEATED_SHARE, DEVIATIONS = 0.003, 5.0


def check_frozen(series: Series) -> Iterator[Marked]:
    """Yield the outputs that stay at one value; one that stays at an end of its range is clipped instead."""
    for name, values in series.outputs.items():
        rows = frozen_rows(series, name, values)
        n = int(rows.sum())
        if not n:
            continue
        begin, end = max(runs(rows), key=lambda run: run[1] - run[0])
        steady = n == len(values)
        if steady and (step := step_of_one_code(series, name)) is not None:
            yield _one_code(series, name, step)
            continue
        whole = not steady and any(rows[part].mean() > MAX_OF_SET for part in series.parts)
        sure = whole or CERTAIN_SHARE * len(series) < n < len(series)
        seconds = float(series.t_s[end - 1] - series.t_s[begin])
        yield Marked(
            Finding(
                "frozen", "certain" if sure else "likely", f"{name}, {rows_in_words(rows)}",
                f"the output stays at {values[begin]:.6g} deg/s for {seconds:.3g} s ({end - begin} readings)"
                + (", all of the recording: it is dead, or its steps are far larger than its noise" if steady else ""),
                float(values[begin]), "deg/s", "readings that differ by their noise",
                "check the output and its resolution" if steady else "leave these readings out, or measure again",
                channel=name, n=n, may_leave_out=not steady,
            ),
            rows,
        )  # fmt: skip


def step_of_one_code(series: Series, name: str) -> float | None:
    """Return the step that an output is coarse in that stays at one value, deg/s; None for one that is dead.

    Other outputs show it: they come in coarse steps, and the value is a multiple of theirs; or they stay at one value
    each too, as those of one converter do, and only a limit is known: 0 is returned.
    """
    if series.rate_dps is None or np.ptp(series.rate_dps):
        return None  # a table that turns would move an output of any step
    value = float(series.outputs[name][0])
    other_outputs = {other: values for other, values in series.outputs.items() if other != name}
    if not any(np.ptp(values) for values in other_outputs.values()):
        return 0.0
    coarse = [
        series.code_steps[other]
        for other, readings in other_outputs.items()
        if series.code_steps[other] > COARSE_LATTICE * spread_of(readings)
    ]
    return next((step for step in coarse if abs(value / step - round(value / step)) < ON_LATTICE), None)


def _one_code(series: Series, name: str, step: float) -> Marked:
    values = series.outputs[name]
    if step:
        reason = f"another output comes in steps of {step:.4g} deg/s, and this value is a multiple of them"
    else:
        reason = "no other output changes either"
    return Marked(
        Finding(
            "quantised", "likely", name,
            f"the output is {values[0]:.6g} deg/s in all {len(values)} readings: its steps are far larger than its "
            f"noise ({reason}), or the unit does not measure",
            step or None, "deg/s", "readings that differ by their noise",
            "log the output with more digits or a finer converter, and check that the unit is switched on",
            channel=name, n=len(values),
        ),
        np.ones(len(values), dtype=bool),
    )  # fmt: skip


def frozen_rows(series: Series, name: str, values: Array) -> Rows:
    """Return which rows, (n,), are in a run of equal readings that is no accident."""
    is_frozen = np.zeros(len(values), dtype=bool)
    # a run of k+1 equal readings is k steps of 0
    steady = [(begin, end + 1) for begin, end in runs(np.diff(values) == 0)]
    if not steady:
        return is_frozen
    usual = [end - begin for begin, end in steady if end - begin <= USUAL_RUN]
    long = sum(end - begin for begin, end in steady if end - begin > USUAL_RUN)
    last_begin = len(values) - long
    share = min(sum(length - 1 for length in usual) / last_begin, 0.9) if last_begin > MIN_RUN else 0.9
    is_coarse = series.code_steps[name] > COARSE_NOISES * series.noises[name]
    least = MIN_RUN if is_coarse else max(MIN_RUN, np.log(CHANCE / len(values)) / np.log(max(share, 1e-3)))
    ends = (float(values.min()), float(values.max()))
    gain = gain_of(values, series.rate_dps)
    for begin, end in steady:
        at_end = values[begin] in ends and ends[0] != ends[1] and not is_coarse
        if at_end and series.motion == "rest" and np.sum(values == values[begin]) == end - begin:
            at_end = False  # all in one stretch: noise at the end of a range comes to it again and again
        if end - begin < least or at_end:
            continue
        if is_coarse and not _would_move(series, slice(begin, end), gain, series.code_steps[name]):
            continue
        is_frozen[begin:end] = True
    return is_frozen


def _would_move(series: Series, rows: slice, gain: float, step: float) -> bool:
    return series.rate_dps is not None and abs(gain) * float(np.ptp(series.rate_dps[rows])) > COARSE_STEPS * step


def check_repeated(series: Series, frozen: Rows) -> Iterator[Marked]:
    """Yield rows that hold in every output, of an accelerometer too, what the row before holds.

    A thermometer may be read by itself.
    """
    forces = [values for name, values in series.others.items() if name.startswith("accel_")]
    channels = [*series.outputs.values(), *forces]
    equal = _equal(channels, 1) & ~frozen[1:] & (series.dataset[1:] == series.dataset[:-1])
    apart = _equal(channels, 3) & ~frozen[3:] & (series.dataset[3:] == series.dataset[:-3])
    n = len(series)
    share, usual = equal.sum() / n, max(apart.sum() / n, _chance_of_equal(series))
    if share - usual <= max(REPEATED_SHARE, DEVIATIONS * np.sqrt((share + usual) / n)):
        return
    rows = np.concatenate([[False], equal])
    yield Marked(
        Finding(
            "repeated", "likely", rows_in_words(rows),
            f"{int(rows.sum())} rows repeat the outputs of the row before ({100 * share:.2g} % of all)",
            100 * float(share), "%", f"at most {100 * usual:.2g} %, as by chance",
            "leave the repeated rows out: they are no new readings, and make the noise look smaller than it is",
            n=int(rows.sum()), may_leave_out=True,
        ),
        rows,
    )  # fmt: skip


def _chance_of_equal(series: Series) -> float:
    """Return how often a row equals the row before by chance, by how often its outputs differ by one code and by two.

    Differences of neighbours thin out evenly from code to code, as a normal distribution does, also where an output
    that was smoothed differs by few codes; of readings that are written again only those that do not differ are more.
    """
    chance = 1.0
    for name, values in series.outputs.items():
        step = series.code_steps[name]
        if not step:
            return 0.0
        codes = np.abs(np.round(np.diff(values) / step))
        one, two = (max(float(np.mean(codes == k)) / 2, 0.5 / len(codes)) for k in (1, 2))
        chance *= min(one * max(one / two, 1.0) ** (1.0 / 3.0), 1.0)
    return chance


def _equal(channels: list[Array], lag: int) -> Rows:
    return np.asarray(np.all([values[lag:] == values[:-lag] for values in channels], axis=0))

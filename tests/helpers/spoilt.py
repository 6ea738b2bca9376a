"""Recordings in which one thing is wrong, made from good ones."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from labctl.recording import Recording

Columns = dict[str, np.ndarray]


def spoilt(recording: Recording, edit: Callable[[Columns], None], **info: Any) -> Recording:
    """Return a copy of a recording whose columns an edit has changed, and whose head says something else."""
    columns = {name: np.array(values) for name, values in recording.columns.items()}
    edit(columns)
    return replace(recording, info=recording.info.model_copy(update=info), columns=columns)


def scaled(factor: float, *names: str) -> Callable[[Columns], None]:
    """Return an edit that multiplies columns."""

    def edit(columns: Columns) -> None:
        for name in names:
            columns[name] = columns[name] * factor

    return edit


def exchanged(first: str, second: str) -> Callable[[Columns], None]:
    """Return an edit that exchanges two columns."""

    def edit(columns: Columns) -> None:
        columns[first], columns[second] = columns[second], columns[first]

    return edit


def of_dataset(columns: Columns, rate_dps: float, which: int = 5) -> np.ndarray:
    """Return the readings, as a mask, of one of the data sets at a rate."""
    numbers = np.unique(columns["dataset"][np.abs(columns["table_rate_dps"] - rate_dps) < 1])
    return np.asarray(columns["dataset"] == numbers[which])


def at_one_dataset(rate_dps: float, change: Callable[[Columns, np.ndarray], None]) -> Callable[[Columns], None]:
    """Return an edit of one data set at a rate."""
    return lambda columns: change(columns, of_dataset(columns, rate_dps))


def flip(columns: Columns, here: np.ndarray) -> None:
    """Give the output of some readings the other sign."""
    columns["gyro_z"][here] *= -1


def wrong_rate(columns: Columns, here: np.ndarray) -> None:
    """Give some readings a rate that is another one's."""
    columns["table_rate_dps"][here] = 60.0


def shake(columns: Columns, here: np.ndarray) -> None:
    """Move the unit to and fro by 20 deg/s."""
    columns["gyro_z"][here] += 20 * np.sin(np.arange(here.sum()) / 20)


def slow_down(columns: Columns, here: np.ndarray) -> None:
    """Let the table run at half the rate from the middle of a data set on, without saying so."""
    rows = np.flatnonzero(here)
    columns["gyro_z"][rows[len(rows) // 2 :]] -= 40.0


def quantised(step: float) -> Callable[[Columns], None]:
    """Return an edit that rounds the output to multiples of a step."""

    def edit(columns: Columns) -> None:
        columns["gyro_z"] = np.round(columns["gyro_z"] / step) * step

    return edit


def with_gaps(columns: Columns) -> None:
    """Take a third of its readings out of each data set, in one piece."""
    dataset = columns["dataset"]
    kept = np.ones(len(dataset), dtype=bool)
    for number in np.unique(dataset):
        rows = np.flatnonzero(dataset == number)
        kept[rows[len(rows) // 4 : len(rows) // 4 + len(rows) // 3]] = False
    for name in list(columns):
        columns[name] = columns[name][kept]

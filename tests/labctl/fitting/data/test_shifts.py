"""Shifts between recordings as the base of a criticism has them: the bias of a recording is one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from labctl.fitting.data.channels import Channels
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.data.joined import joined_recording
from labctl.fitting.data.shifts import shift_columns, shift_contrasts, shifts_of, shown_shifts
from labctl.recording import Recording
from tests.helpers.joint_recordings import recordings


def in_runs(recording: Recording, runs: int) -> Recording:
    """Return a recording as if its units had been switched off in between."""
    run = 1 + np.arange(len(recording)) * runs // len(recording)
    return replace(recording, columns={**recording.columns, "run": run})


def channels(*runs: int) -> Channels:
    parts = recordings(5, tuple(10.0 * day for day in range(len(runs))))
    whole = {n: in_runs(part, count) for (n, part), count in zip(parts.items(), runs, strict=True)}
    return fit_data_of(joined_recording(whole)).channels


def reproduced(columns: np.ndarray, by: np.ndarray) -> bool:
    solution, *_ = np.linalg.lstsq(by, columns, rcond=None)
    return bool(np.allclose(by @ solution, columns, atol=1e-9))


def test_a_fit_has_a_shift_of_each_run_and_a_criticism_one_of_each_recording() -> None:
    several = channels(3, 2)
    assert [shift.number for shift in shifts_of(several, "z") if shift.kind == "turn_on"] == [1, 2, 3, 4, 5]
    contrasts, largest = shift_contrasts(several, "z")
    assert largest.tolist() == [5.0, 0.1]  # the biases and the scale factors of two recordings differ
    of = np.asarray(several["recording"])
    between = ((of == 2).astype(float) - np.mean(of == 2))[:, None]
    run = np.asarray(several["run"])
    within = ((run == 2).astype(float))[:, None]
    beside_constant = np.column_stack([np.ones(len(of)), contrasts])
    assert reproduced(between, beside_constant)
    assert not reproduced(within, beside_constant)  # what differs within a recording is evidence


def test_one_run_in_each_recording_is_the_same_for_both() -> None:
    single = channels(1, 1, 1)
    contrasts, _ = shift_contrasts(single, "z")
    constant = np.ones((len(single), 1))
    runs = shift_columns(single, "z")
    assert reproduced(np.column_stack([constant, contrasts]), np.column_stack([constant, runs]))


def test_a_shift_that_is_known_is_shown_by_rows_of_one_recording_alone() -> None:
    several = channels(2, 2)
    second = several.take(np.asarray(several["recording"]) == 2)
    assert shifts_of(second, "z") == []
    assert [shift.name for shift in shown_shifts(second, "z")] == ["turn_on_3", "turn_on_4", "day_to_day_2"]

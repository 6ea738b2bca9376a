"""The step clock by timed runs, against runs that numpy alone draws."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from instruments.interfaces.table import StepClock
from procedures.contracts.journal import ClockRun
from procedures.monitoring.step_clock import change_ppm, fitted, measured
from procedures.planning.clock_runs import run_lengths_s

NOMINAL = StepClock(2e6, 50.0)


def drawn(
    rng: np.random.Generator,
    blocks: int,
    scatter_s: float,
    ppm_per_h: float = 0.0,
    session: int = 1,
    ppm: float = -350.0,
) -> list[ClockRun]:
    """Return runs of a clock that is off by `ppm` and drifts, two hours from block to block."""
    runs: list[ClockRun] = []
    for block in range(blocks):
        for steady_s in run_lengths_s(2 if block else 4, len(runs), 10.0, 60.0):
            t_s = 7200.0 * block + 80.0 * (len(runs) % 4)
            ratio = 1 + 1e-6 * (ppm + ppm_per_h * t_s / 3600)
            late_s = 3.4 + float(rng.normal(0.0, scatter_s))
            runs.append(ClockRun(session, block, t_s, steady_s, steady_s / ratio + late_s, 400.0))
    return runs


def test_runs_without_scatter_give_the_clock_and_its_drift_exactly() -> None:
    found = fitted(drawn(np.random.default_rng(0), 4, 0.0, ppm_per_h=12.0))
    assert found is not None
    assert found.ratio(0.0) == pytest.approx(1 - 350e-6, abs=1e-9)
    assert found.drift_ppm_per_h == pytest.approx(12.0, abs=1e-3)
    assert (found.freedom, found.has_drift) == (7, True)


def test_a_drift_is_not_continued_beyond_the_last_run() -> None:
    runs = drawn(np.random.default_rng(0), 3, 0.0, ppm_per_h=12.0)
    found = fitted(runs)
    assert found is not None
    assert found.ratio(1e6) == found.ratio(max(run.t_s for run in runs))


def test_a_drift_that_the_scatter_explains_is_not_applied_and_stays_in_u() -> None:
    """Runs of a noisy computer: rates must not follow a slope that is none, or temperatures get one."""
    rng, applied, inside = np.random.default_rng(7), [], []
    for _ in range(400):
        runs = drawn(rng, 4, 0.010)
        found = fitted(runs)
        assert found is not None
        applied.append(found.is_drift_applied)
        ends = [found.ratio(t_s) for t_s in (runs[0].t_s, runs[-1].t_s)]
        assert (ends[0] == ends[1]) is not found.is_drift_applied
        assert found.u_ppm(runs[-1].t_s) > 1.2 * found.u_ppm(found.middle_s)
        inside.append(1e6 * abs(ends[1] - (1 - 350e-6)) <= found.expanded_ppm(runs[-1].t_s))
    assert 0.025 < np.mean(applied) < 0.08  # of a level of confidence of 95 %
    assert np.mean(inside) >= 0.94


@pytest.mark.parametrize("ppm_per_h", [2.0, 10.0, 20.0, 40.0])
def test_a_drift_that_is_left_out_is_within_u_at_the_last_run(ppm_per_h: float) -> None:
    rng, inside = np.random.default_rng(8), []
    for _ in range(400):
        runs = drawn(rng, 4, 0.005, ppm_per_h=ppm_per_h)
        found = fitted(runs)
        assert found is not None
        true = 1 + 1e-6 * (-350.0 + ppm_per_h * found.until_s / 3600)
        inside.append(1e6 * abs(found.ratio(found.until_s) - true) <= found.expanded_ppm(found.until_s))
    assert np.mean(inside) >= 0.93


def test_too_few_runs_give_no_scatter_and_no_clock() -> None:
    runs = drawn(np.random.default_rng(0), 1, 0.001)
    assert fitted([]) is None
    assert fitted(runs[:2]) is None
    assert fitted([replace(run, nominal_s=10.0) for run in runs]) is None  # one length tells no rate


@pytest.mark.parametrize("blocks", [1, 2, 6])
def test_the_truth_is_inside_its_expanded_uncertainty_as_often_as_it_says(blocks: int) -> None:
    rng, inside = np.random.default_rng(32), []
    for _ in range(400):
        runs = drawn(rng, blocks, 0.005, ppm_per_h=5.0 * (blocks > 1))
        found = fitted(runs)
        assert found is not None
        true = 1 + 1e-6 * (-350.0 + 5.0 * (blocks > 1) * found.middle_s / 3600)
        inside.append(1e6 * abs(found.ratio(found.middle_s) - true) <= found.expanded_ppm(found.middle_s))
    assert 0.925 < np.mean(inside) < 0.975  # 95 % within 2.3 standard deviations of 400 draws


def test_one_late_reply_makes_the_clock_uncertain() -> None:
    """Measured -417, -426 and -1542 ppm on a busy computer: u is not that of a quiet one."""
    runs = drawn(np.random.default_rng(1), 1, 1e-4)
    quiet = measured(runs, NOMINAL)
    busy = measured([*runs[:3], replace(runs[3], duration_s=runs[3].duration_s + 0.067)], NOMINAL)
    assert quiet is not None
    assert busy is not None
    assert quiet.expanded_ppm < 20
    assert busy.expanded_ppm > abs(busy.deviation_ppm + 350.0) > 500


def test_the_clock_of_a_session_is_compared_with_that_of_those_before() -> None:
    rng = np.random.default_rng(2)
    before, same = drawn(rng, 1, 0.001, ppm=-412.0), drawn(rng, 1, 0.001, session=2, ppm=-412.0)
    other = drawn(rng, 1, 0.001, session=2, ppm=-845.0)
    change, chance = change_ppm([*before, *same], 2) or (np.nan, np.nan)
    assert abs(change) < chance
    change, chance = change_ppm([*before, *other], 2) or (np.nan, np.nan)
    assert change == pytest.approx(-433.0, abs=60)
    assert change_ppm(before, 1) is None


def test_no_two_runs_are_of_one_length() -> None:
    lengths_s = [*run_lengths_s(4, 0, 10.0, 60.0), *run_lengths_s(20, 4, 10.0, 60.0)]
    assert len(set(lengths_s)) == 24
    assert [round(each / 60) for each in lengths_s[:4]] == [0, 1, 0, 1]
    phases = np.sort(np.array(lengths_s) % 0.016)
    assert np.diff(phases).max() < 0.004  # the period of a timer is filled

"""Coverage of a promise until the due date: units without a history, by their type; and units with one, by their own.

Every unit is simulated with numpy alone: its drift per year is drawn from a population with a mean and a spread,
changes from interval to interval, and is measured by calibrations with noise. What is promised is a corrected rate on a
later day: it is off by what the last calibration measured wrongly, and by the drift since. All are in units of the
spread.
`LABCTL_STUDY_UNITS` is how many units each figure is of, `LABCTL_STUDY_SEED` the seed.
"""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.uncertainty.drift_prediction import DriftPrediction, of_item, of_type, with_drift
from studies.report_tables import wilson

UNITS = int(os.environ.get("LABCTL_STUDY_UNITS", "4000"))
SEED = int(os.environ.get("LABCTL_STUDY_SEED", "30007"))
#: Years of an interval between calibrations, of the past and to the due date.
YEARS = (0.5, 2.0)
#: Most intervals in the history of a unit of the type.
MAX_INTERVALS = 4
#: Scatter of a unit's drift from interval to interval.
SCATTER = 0.3
#: Units that share the lengths of the intervals of a draw.
BATCH = 100

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Population:
    """A type of units, in units of the spread of its drifts per year, or of the noise where they do not drift."""

    mean: float
    noise: float  #: standard uncertainty of a calibration
    spread: float = 1.0
    scatter: float = SCATTER
    is_walk: bool = False  #: the errors walk at random: a change grows with the root of time, and no rate persists
    due_years: float | None = None  #: to the due date; None: as long as any interval

    def years(self, rng: np.random.Generator, units: int, intervals: int) -> Array:
        """Return lengths of intervals, (units, intervals), of which the last is that to the due date."""
        found = rng.uniform(*YEARS, size=(units, intervals))
        found[:, -1] = found[:, -1] if self.due_years is None else self.due_years
        return found

    def rates(self, rng: np.random.Generator, years: Array, trials: int) -> Array:
        """Return true changes by their years, (units, intervals, trials), of intervals of some years."""
        units, intervals = years.shape
        size = (1 / np.sqrt(years) if self.is_walk else np.full_like(years, self.scatter))[:, :, np.newaxis]
        steady = 0.0 if self.is_walk else self.mean + self.spread * rng.normal(size=(units, 1, trials))
        return np.asarray(steady + self.spread * size * rng.normal(size=(units, intervals, trials)))

    def history(self, rng: np.random.Generator, years: Array, trials: int) -> tuple[Array, Array]:
        """Return changes by their years as calibrations show them, and the errors of the newest, (units, trials).

        The last interval is that to the due date: it is not seen, and returned as it is.
        """
        true = self.rates(rng, years, trials)
        errors = self.noise * rng.normal(size=true.shape)
        true[:, :-1] += np.diff(errors, axis=1) / years[:, :-1, np.newaxis]
        return true, errors[:, -1]

    def inside(self, predicted: DriftPrediction, rates: Array, last: Array, years: float) -> int:
        """Return how many corrected rates are within their promise at the due date."""
        spread, mean = predicted.expanded_about_mean_dps * years, np.abs(predicted.mean_dps) * years
        half = [with_drift(2 * self.noise, *each) for each in zip(spread.tolist(), mean.tolist(), strict=True)]
        return int(np.sum(np.abs(last - rates * years) <= half))


def by_type(population: Population, units: int, trials: int, seed: int) -> float:
    """Return the share of units without a history that are within the promise by other units of their type."""
    inside = 0
    for batch in range(trials // BATCH):
        rng = np.random.default_rng([seed, units, batch])
        years = population.years(rng, units + 1, MAX_INTERVALS + 1)
        known = np.arange(MAX_INTERVALS) < rng.integers(1, MAX_INTERVALS + 1, size=(units, 1))
        rates, last = population.history(rng, years, BATCH)
        seen = np.where(known[:, :, np.newaxis], rates[:-1, :-1], np.nan)
        inside += population.inside(of_type(seen, years[:-1, :-1]), rates[-1, -1], last[-1], float(years[-1, -1]))
    return inside / (trials // BATCH * BATCH)


def by_item(population: Population, intervals: int, trials: int, seed: int) -> float:
    """Return the share of units with a history that are within the promise by their own intervals."""
    inside = 0
    for batch in range(trials // BATCH):
        rng = np.random.default_rng([seed, intervals, batch])
        years = population.years(rng, 1, intervals + 1)
        rates, last = population.history(rng, years, BATCH)
        inside += population.inside(of_item(rates[0, :-1]), rates[0, -1], last[0], float(years[0, -1]))
    return inside / (trials // BATCH * BATCH)


def run(trials: int = UNITS, seed: int = SEED) -> str:
    """Return the tables."""
    populations = {
        f"mean {mean:g}, noise {noise:g}": Population(mean, noise) for noise in (0.1, 0.3) for mean in (0.0, 1.0, 3.0)
    }
    populations["mean 0, noise 1"] = Population(0.0, 1.0)
    populations["no drift"] = Population(0.0, 1.0, 0.0)
    populations["random walk, noise 0.1"] = Population(0.0, 0.1, is_walk=True)
    populations["the same, due in 0.25 years"] = Population(0.0, 0.1, is_walk=True, due_years=0.25)
    both = (
        ("by its type", "units", (3, 5, 10, 20, 40), by_type),
        ("by its own history", "intervals", (1, 2, 4, 8), by_item),
    )
    lines = []
    for title, of, numbers, share_of in both:
        heads = [f"{n} {of if n > 1 else of[:-1]}" for n in numbers]
        lines += [f"| {title}, within the promise, % | " + " | ".join(heads) + " |", "| --- " * (len(heads) + 1) + "|"]
        for name, each in populations.items():
            shares = [_cell(share_of(each, n, trials, seed), trials) for n in numbers]
            lines.append(f"| {name} | " + " | ".join(shares) + " |")
        lines.append("")
    return "\n".join(lines)


def _cell(share: float, trials: int) -> str:
    low, high = wilson(round(share * trials), trials)
    return f"{100 * share:.1f} ({100 * low:.1f} to {100 * high:.1f})"

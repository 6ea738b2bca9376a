"""Figures of the readings of one data set: noise, sudden change of level, and wander."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

#: Blocks of a data set between which its level is compared, and readings that one block needs.
LEVEL_BLOCKS, LEAST_PER_BLOCK, LEAST_BLOCKS = 16, 2, 8
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
    blocks = min(LEVEL_BLOCKS, len(values) // LEAST_PER_BLOCK)
    if blocks < LEAST_BLOCKS:
        return NO_CHANGE
    means = block_means(values, blocks)
    noise_of_block = noise / np.sqrt(len(values) / blocks)
    at = np.arange(2, blocks)
    left, right = np.concatenate([at, at[:-1]]), np.concatenate([at, at[:-1] + 1])  # with and without a block between
    sums, squares = (np.concatenate([[0.0], np.cumsum((means - means[0]) ** power)]) for power in (1, 2))
    after = blocks - right
    low, high = sums[left] / left, (sums[-1] - sums[right]) / after
    scatter = squares[left] - left * low**2 + squares[-1] - squares[right] - after * high**2
    rests = np.sqrt(np.maximum(scatter, 0.0) / (left + after - 2))
    k = int(np.argmin(rests))
    best_rest = float(rests[k])
    best = Change(float(high[k] - low[k]), int((left[k] + right[k]) / 2 * len(values) / blocks))
    still = best_rest <= max(STILL_NOISES * noise_of_block, STILL_SHARE * abs(best.size))
    large = abs(best.size) > CHANGE_RATIO * max(best_rest, noise_of_block)
    return best if still and large else NO_CHANGE


def wander(values: NDArray[np.float64], temperature_c: NDArray[np.float64] | None, noise: float) -> float:
    """Return the root mean square by which block means of readings (n,) move, beyond what noise explains.

    A cubic in time and in temperature, and decays after the start, do not count: those are drift.
    """
    blocks = min(WANDER_BLOCKS, len(values) // LEAST_PER_BLOCK)
    if blocks < WANDER_BLOCKS // 2:
        return 0.0
    means = block_means(values, blocks)
    at = np.linspace(-1.0, 1.0, blocks)
    columns = [at**power for power in range(4)] + [np.exp(-np.arange(blocks) / decay) for decay in DECAYS]
    if temperature_c is not None:
        warm = block_means(temperature_c, blocks)
        span = float(np.ptp(warm))
        if span > 0.1:
            columns += [((warm - warm.mean()) / span) ** power for power in (1, 2, 3)]
    design = np.column_stack(columns)
    q, _ = np.linalg.qr(design)
    left = means - q @ (q.T @ means)
    square = float(np.sum(left**2)) / (blocks - design.shape[1])
    return float(np.sqrt(max(square - noise**2 * blocks / len(values), 0.0)))

"""The evidence for effects of a few shapes that may be missing from a model: NumPy only, nothing of labctl.

`docs/explanation/criticism.md` states it under *Evidence, in numbers*. Effects whose coefficients are draws, and sizes
that a technology hardly has, are not written here.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from studies.page_figures_lack import NODES, AxisNoise, Reduced

Array = np.ndarray
#: Share of the squared length of a direction that the base has to leave; evidence from which on the size counts, nats.
REMAINING, SUPPORTED = 1e-4, 2.0


def shapes_of(effect: str, reduced: Reduced, axis: str) -> list[Array] | None:
    """Return the shapes of an effect on one output, (R, m, q) each; None: it is not written here."""
    rate = np.repeat(reduced.sets.own_rate_dps[axis][:, None], NODES, axis=1)
    if effect == "scale_factor_asymmetry":
        return [reduced.slow(np.abs(rate))[:, :, None]]
    if effect == "supply_sensitivity":
        volt = reduced.at_nodes("supply_v")
        return [reduced.slow(volt - volt.mean())[:, :, None]]
    if effect == "scale_factor_odd":
        powers = [reduced.slow((rate / np.abs(rate).max()) ** power) for power in (3, 5)]
        return [np.stack(powers[:number], axis=2) for number in (1, 1, 2)]  # of the orders 3, 4 and 5
    return None


def log_bayes_factor(effect: str, axes: Sequence[AxisNoise]) -> float | None:
    """Return the evidence for an effect on all outputs or on one, nats; None: it is not written here."""
    each = []
    for noise in axes:
        shapes = shapes_of(effect, noise.reduced, noise.axis)
        if shapes is None:
            return None
        found = [_of_shape(noise, columns) for columns in shapes]
        assert max(found) < SUPPORTED, "a size that counts is not written here"
        each.append(float(np.logaddexp.reduce(found) - np.log(len(found))))
    if len(each) == 1:
        return each[0]
    alone = [evidence - np.log(len(each)) for evidence in each]
    return float(np.logaddexp.reduce([sum(each), *alone]) - np.log(2))


def _of_shape(noise: AxisNoise, columns: Array) -> float:
    """Return the log Bayes factor of a shape on one output, averaged over the drifts."""
    g = float(columns.shape[1])
    log_p, log_bf = [], []
    for fit in noise.fits:
        rows = noise.whitened(columns, fit)
        rows = rows / np.linalg.norm(rows, axis=0)
        left = rows - fit.base @ (fit.base.T @ rows)
        values, vectors = np.linalg.eigh(left.T @ left)
        seen = values > REMAINING
        gain = float(np.sum((vectors.T @ (left.T @ fit.y))[seen] ** 2 / values[seen]))
        log_p.append(fit.log_p)
        log_bf.append(0.5 * gain * g / (1 + g) - 0.5 * seen.sum() * np.log1p(g))
    return float(np.logaddexp.reduce(np.add(log_p, log_bf)) - np.logaddexp.reduce(log_p))

"""Temperatures at which the constants of a linear model are tabulated for code without labctl."""

from __future__ import annotations

import math

import numpy as np

from labctl.fitting.models.matrix_form import Linear
from labctl.fitting.models.temperature import LagrangeTable
from labctl.fitting.numeric.arrays import Array

#: Polynomials in temperature are exact on this many nodes with as many points.
POLYNOMIAL_NODES = 6


def temperature_nodes(linear: Linear, span_c: tuple[float, float]) -> tuple[Array, int]:
    """Return the temperatures (n,) at which a model is tabulated, and over how many of them it is interpolated."""
    basis = linear.fitted.model.temperature
    if isinstance(basis, LagrangeTable) and not any("temperature" in e for e in linear.fitted.model.effect_ids):
        return np.array(basis.nodes_c), basis.points
    low, high = span_c
    if not math.isfinite(high - low):  # made without a thermometer: the same at every temperature
        return np.array([0.0]), 1
    return np.linspace(low, max(high, low + 1.0), POLYNOMIAL_NODES), POLYNOMIAL_NODES

"""Coefficients in the papers' own units and names; named, never positional."""

from __future__ import annotations

from math import comb

from labctl.fitting.models.fitted_model import AxisFit, FittedModel
from labctl.fitting.models.temperature import LagrangeTable


def in_paper_units(fitted: FittedModel) -> dict[str, object]:
    """Return what the papers would print of a model; empty for a model of no paper."""
    if fitted.model.name == "ojeda2000":
        reference = fitted.model.reference.temperature_c
        return {"ojeda2000": {axis: ojeda_matrix(fit, reference) for axis, fit in fitted.axes.items()}}
    if fitted.model.name == "yang2018" and isinstance(fitted.model.temperature, LagrangeTable):
        return {"yang2018": yang_rows(fitted, fitted.model.temperature)}
    return {}


def ojeda_matrix(fit: AxisFit, reference_c: float) -> dict[str, float]:
    """Return C of Ojeda et al. 2000, eq. 10: "C[i,j]" multiplies w_g^i T^j; w_g in deg/s, T in deg C, not centred."""
    raw: dict[str, float] = {}
    for name, values in zip(fit.names, fit.values, strict=True):
        if not name.startswith("c_r"):
            continue
        rate_power, temperature_power = (int(part) for part in name.removeprefix("c_r").split("_t"))
        for j in range(temperature_power + 1):
            share = comb(temperature_power, j) * (-reference_c) ** (temperature_power - j)
            key = f"C[{rate_power},{j}]"
            raw[key] = raw.get(key, 0.0) + float(values[0]) * share
    return raw


def yang_rows(fitted: FittedModel, table: LagrangeTable) -> list[dict[str, float]]:
    """Return K_g of Yang et al. 2018 at each node: Kij multiplies the rate about i in the output of j; Bi in deg/s."""
    rows = []
    for node, temperature in enumerate(table.nodes_c):
        row: dict[str, float] = {"temperature_c": temperature}
        for out, fit in fitted.axes.items():
            for name, values in zip(fit.names, fit.values, strict=True):
                value = float(values[node])
                if name == "bias":
                    row[f"B{out}"] = value
                elif name == "scale_factor":
                    row[f"K{out}{out}"] = 1.0 + value
                elif name.startswith("misalignment_"):
                    row[f"K{name[-1]}{out}"] = value
        rows.append(row)
    return rows

"""The figures of the page of a unit beside the same that was recomputed: versions, U in use, data sheet, trend."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from studies.page_figures_budget import coverage_factor, effective_freedom, leaning_rad, line_of, of_datasheet
from studies.page_figures_formulas import alignment_deg, asymmetry, nonlinearity, slope_over, straight_line
from studies.page_figures_pages import OF_A_MEAN, SMALL_DIFFERENCE, Compared, Row, figure, rms
from studies.page_figures_recomputed import clock_u_of, info_of, turning_size_of
from studies.page_figures_refit import temperature_levels

#: Figures of the data sheet that straight lines through the output over the rate give.
STRAIGHT_LINE = ("bias", "scale_factor", "scale_factor_asymmetry", "scale_factor_nonlinearity")
OVER_TEMPERATURE = ("bias_temperature", "scale_factor_temperature")


def unit_page(c: Compared) -> Iterator[Row]:
    """Yield the figures of the page of a unit: versions, coefficients, uncertainty in use, the error over the years."""
    answer, fitted = c.get(c.path), c.fitted_dps
    raw = rms(*(each[0] for each in c.errors.values()))
    rows = c.get(f"/api/units/{c.serial}/calibrations")
    (step,) = (each for each in c.get(f"/api/units/{c.serial}/ladder")["steps"] if each["version"] == c.version)
    (row,) = (each for each in rows if each["version"] == c.version)
    yield figure(
        "RMS error without a correction",
        [answer["error"]["raw_rms_dps"], step["raw_rms_dps"]],
        [raw, raw],
        SMALL_DIFFERENCE,
    )
    yield figure("RMS error of a version", [answer["error"]["rms_dps"], step["rms_dps"], row["rms_dps"]],
                 [rms(*fitted.values())] * 3, SMALL_DIFFERENCE)  # fmt: skip
    for axis, own in answer["axes"].items():
        names = c.law.names[axis]
        shown = [own["coefficients"][name] for name in names]
        yield figure(
            "coefficients", [each["value"] for each in shown], [c.law.coefficients[axis][name] for name in names], 0.0
        )
        yield figure("u of coefficients", [each["u"] for each in shown], np.sqrt(np.diag(c.law.covariance[axis])))
    yield from _uncertainty(c, answer["validity"])
    yield from _datasheet(c)
    yield from _alignment(c)
    yield from _trend(c)


def _uncertainty(c: Compared, validity: Any) -> Iterator[Row]:
    """Yield the contributions in use at a rate: that of the fit by its covariance, and how all are combined."""
    rate, warm = 0.5 * max(validity["rate_dps"]), float(np.mean(validity["temperature_c"]))
    answer = c.get(f"{c.path}/uncertainty?rate_dps={rate}&temperature_c={warm}")
    for axis, one in answer["axes"].items():
        own = c.law.u_of_fit(np.where(np.array(list("xyz")) == axis, rate, 0.0), warm, c.left.correlation)
        yield figure("u of the coefficients in use", [one["coefficients_dps"]], [own[c.law.axes.index(axis)]],
                     SMALL_DIFFERENCE)  # fmt: skip
        budget = answer["budget"][axis]
        yield from _bench(c, axis, budget, rate, warm)
        first_order = [line for line in budget["lines"] if line["u"] is not None and line["sensitivity"]]
        yield figure("contributions in use", [line["contribution"] for line in first_order],
                     [abs(line["u"] * line["sensitivity"]) for line in first_order])  # fmt: skip
        if budget["combined"] is not None:
            combined = float(np.sqrt(sum(line["contribution"] ** 2 for line in budget["lines"])))
            k = answer["coverage_factor"]
            shown = [budget["combined"], budget["expanded"], k * one["combined_dps"]]
            yield figure("combined and expanded uncertainty", shown,
                         [combined, budget["k"] * combined, budget["k"] * combined])  # fmt: skip


def _bench(c: Compared, axis: str, budget: Any, rate_dps: float, temperature_c: float) -> Iterator[Row]:
    """Yield the lines of the reference standards and of the data sheet, and the coverage of all lines together."""
    info, lines = info_of(c.database, c.recording), {line["source"]: line for line in budget["lines"]}
    size = 0.0 if info["latitude_deg"] is None else turning_size_of(c.database, c.recording)
    for standard in info["standards"]:
        line = lines[standard["quantity"]]
        own = line_of(standard, c.law, axis, rate_dps, temperature_c, size)
        for name, each in zip(("u", "sensitivity", "contribution"), own, strict=True):
            yield figure(f"{name} of a reference standard", [line[name]], [each], SMALL_DIFFERENCE)
    if lines["repeatability"]["name"].startswith("data sheet"):
        stated = (info[name]["bias_stability_dps"] for name in ("datasheet", "datasheet_conventions"))
        yield figure("repeatability by the data sheet", [lines["repeatability"]["u"]], [of_datasheet(*stated)])
    if budget["combined"] is not None:
        parts = [(line["contribution"], line["degrees_of_freedom"]) for line in budget["lines"]]
        freedom = effective_freedom(*zip(*parts, strict=True))
        yield figure("effective degrees of freedom", [budget["effective_degrees_of_freedom"]], [freedom])
        yield figure("coverage factor", [budget["k"]], [coverage_factor(freedom)], SMALL_DIFFERENCE)


def _datasheet(c: Compared) -> Iterator[Row]:
    """Yield the figures of the data sheet that straight lines through the output over the rate give."""
    shown = {
        (each["id"], each["axis"]): [each["value"], each["u"]]
        for each in c.get(f"/api/units/{c.serial}/datasheet")["characteristics"]
        if each["value"] is not None and each["id"] in {*STRAIGHT_LINE, *OVER_TEMPERATURE}
    }
    for axis in c.law.axes:
        own = _characteristics(c, axis)
        assert set(own) == {name for name, of in shown if of == axis}, f"data sheet, axis {axis}: {sorted(own)}"
        for name, figures in own.items():
            said = shown[name, axis][: len(figures)]
            yield figure(f"data sheet: {name.replace('_', ' ')}", said, figures, SMALL_DIFFERENCE)


def _alignment(c: Compared) -> Iterator[Row]:
    """Yield misalignment and orthogonality of three outputs, by their slopes over the rate about each axis."""
    sets, level = c.sets, temperature_levels(c.sets.temperature_c)
    if len(c.law.axes) < len("xyz") or level is None:
        return
    warm = np.bincount(level, sets.temperature_c) / np.bincount(level)
    usual = level == np.argmin(np.abs(warm - 25))
    slopes, u = np.eye(3), leaning_rad(info_of(c.database, c.recording)["standards"]) * (1 - np.eye(3))
    for j, about in enumerate("xyz"):
        rows = usual & np.array([up[-1] == about for up in sets.position])
        for i, axis in enumerate("xyz"):
            found, u_found = straight_line(sets.output_dps[axis][rows], sets.own_rate_dps[about][rows])
            slopes[i, j], u[i, j] = found[1], np.hypot(u_found[1], u[i, j])
    own = dict(zip(["x", "y", "z", "xy", "xz", "yz"], np.transpose(alignment_deg(slopes, u)), strict=True))
    for each in c.get(f"/api/units/{c.serial}/datasheet")["characteristics"]:
        if each["id"] in {"misalignment", "orthogonality"}:
            yield figure("data sheet: misalignment and orthogonality", [each["value"], each["u"]], own[each["axis"]],
                         SMALL_DIFFERENCE)  # fmt: skip


def _characteristics(c: Compared, axis: str) -> dict[str, Any]:
    """Return value and u of each characteristic of an axis: at the temperature nearest 25 deg C, over temperature."""
    sets, level = c.sets, temperature_levels(c.sets.temperature_c)
    level = np.zeros(len(sets.number), dtype=int) if level is None else level
    about = np.array([up[-1] == axis for up in sets.position])
    warm = np.bincount(level, sets.temperature_c) / np.bincount(level)
    lines = []
    for k in range(len(warm)):
        rows = about & (level == k)
        lines.append(straight_line(sets.output_dps[axis][rows], sets.own_rate_dps[axis][rows]))
    values, u = (np.array(each) for each in zip(*lines, strict=True))
    usual = int(np.argmin(np.abs(warm - 25)))
    rows = about & (level == usual)
    rate, output, white = sets.own_rate_dps[axis][rows], sets.output_dps[axis][rows], c.white_var(axis)
    (bias, slope), (u_bias, u_slope) = values[usual], u[usual]
    own = {
        "bias": [bias, u_bias],
        "scale_factor": [slope, np.hypot(u_slope, clock_u_of(c.database, c.recording) * slope)],
        "scale_factor_asymmetry": asymmetry(output, rate),
        "scale_factor_nonlinearity": nonlinearity(output, rate, None if white is None else white[rows]),
    }
    if len(warm) > 1:
        own["bias_temperature"] = slope_over(warm, values[:, 0], u[:, 0])
        own["scale_factor_temperature"] = np.array(slope_over(warm, values[:, 1], u[:, 1])) * 1e6 / slope
    elif np.ptp(sets.temperature_c) >= 1.0:  # temperatures that are no levels: one line that changes with them
        warmer = sets.temperature_c[about] - sets.temperature_c[about].mean()
        rates = sets.own_rate_dps[axis][about]
        columns = np.column_stack([np.ones(len(rates)), rates, warmer, rates * warmer])
        fitted, left, *_ = np.linalg.lstsq(columns, sets.output_dps[axis][about], rcond=None)
        u_of = np.sqrt(np.diag(np.linalg.inv(columns.T @ columns)) * left[0] / (len(rates) - 4))
        own["bias_temperature"] = [fitted[2], u_of[2]]
        own["scale_factor_temperature"] = np.array([fitted[3], u_of[3]]) * 1e6 / slope
    return own


def _trend(c: Compared) -> Iterator[Row]:
    """Yield the bias and scale factor that a version leaves, and their u, where the unit has a trend."""
    for point in c.get(f"/api/units/{c.serial}/trend")["points"]:
        axes = point["axes"]
        lines = [straight_line(c.residual_dps[axis], c.sets.own_rate_dps[axis]) for axis in axes]
        values, u = (np.array(each) for each in zip(*lines, strict=True))
        shown = {name: [each[name] for each in axes.values()]
                 for name in ("bias_dps", "scale_factor", "u_bias_dps", "u_scale_factor")}  # fmt: skip
        yield figure("bias left by a version", shown["bias_dps"], values[:, 0], OF_A_MEAN)
        # what is left is far smaller than its u: a share of the u is what the figure can be known to
        yield figure("scale factor left by a version, over its u", shown["scale_factor"] / u[:, 1],
                     values[:, 1] / u[:, 1], OF_A_MEAN)  # fmt: skip
        yield figure("u of bias and scale factor left", [shown["u_bias_dps"], shown["u_scale_factor"]], u.T,
                     SMALL_DIFFERENCE)  # fmt: skip

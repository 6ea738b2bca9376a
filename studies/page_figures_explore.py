"""The figures of the page *Explore* beside the same that was recomputed: points, lines, residuals, maps, sizes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from studies.page_figures_formulas import centres, full_turns, ranks
from studies.page_figures_pages import FIVE_DIGITS, ROUNDING, SMALL_DIFFERENCE, Compared, Row, figure, rms
from studies.page_figures_refit import map_cells

#: Rates and temperatures of the map are means over the pieces of a data set.
PIECES = 1e-6
#: Errors per turn are these times as large as the errors themselves.
TURNS = 10
#: Where an answer has the level of the rate and of the temperature.
LEVELS = ("rate_level_dps", "temperature_level_c")
#: Half a unit of the eighth digit.
EIGHT_DIGITS = 5e-8


def explore_page(c: Compared) -> Iterator[Row]:
    """Yield the figures of the page *Explore*: points, lines, residuals, maps, and the sizes in the verdict."""
    yield from _comparison(c)
    criticism = c.get(f"{c.path}/criticism")
    fitted, residual = c.fitted_dps, c.residual_dps
    stated = c.get(c.path)["environment"].get("once_per_turn_dps", {})
    for axis, sizes in c.once_per_turn_dps.items():
        yield figure("Earth's rate once per turn", stated[axis], sizes, SMALL_DIFFERENCE)
    yield from _maps(c, criticism["maps"], fitted)
    yield from _sets(c, criticism["views"]["sets"], fitted)
    yield figure("RMS residual of the fitted model", [criticism["error"]["rms_dps"]], [rms(*fitted.values())],
                 SMALL_DIFFERENCE)  # fmt: skip
    yield from _where(c, criticism["where"], fitted)
    applied = criticism["applied"]
    if applied is not None:
        yield figure("RMS, largest and mean error of a version", [applied[name] for name in ("rms_dps", "max_dps")],
                     [rms(*residual.values()), np.abs(np.concatenate(list(residual.values()))).max()],
                     SMALL_DIFFERENCE)  # fmt: skip
        yield figure(
            "RMS, largest and mean error of a version",
            [[each[name] for name in ("rms_dps", "max_dps", "bias_dps")] for each in applied["axes"].values()],
            [[rms(own), np.abs(own).max(), own.mean()] for own in (residual[axis] for axis in applied["axes"])],
            SMALL_DIFFERENCE,
        )
    for worst in criticism["worst"]:
        place = list(c.sets.number).index(worst["dataset"])
        yield figure(
            "data sets furthest off", [worst["residual_dps"]], [fitted[worst["axis"]][place]], SMALL_DIFFERENCE
        )


def _comparison(c: Compared) -> Iterator[Row]:
    """Yield the points and the lines of *Compare*."""
    sets, answer = c.sets, c.get(f"{c.path}/comparison")
    columns = answer["columns"]
    place = {int(number): k for k, number in enumerate(sets.number)}
    rows = [place[n] for n in columns["dataset"]]
    axis = np.array(columns["axis"])
    keys = list(zip(columns["axis"], rows, strict=True))
    names = ("table_rate_dps", "own_rate_dps", "temperature_c")
    yield figure("rate and temperature of a point", [columns[name] for name in names],
                 [sets.table_rate_dps[rows], [sets.own_rate_dps[a][k] for a, k in keys], sets.temperature_c[rows]],
                 SMALL_DIFFERENCE)  # fmt: skip
    yield figure(
        "measured error", columns["measured_error_dps"], [c.errors[a][0][k] for a, k in keys], SMALL_DIFFERENCE
    )
    yield figure(
        "residual without refitting", columns["residual_dps"], [c.errors[a][1][k] for a, k in keys], SMALL_DIFFERENCE
    )
    modelled = [c.errors[a][0][k] - c.errors[a][1][k] for a, k in keys]
    yield figure("modelled error", columns["modelled_error_dps"], modelled, SMALL_DIFFERENCE)
    for a in c.law.axes:
        own = np.array(rows)[axis == a]
        for level, of, cell in zip(LEVELS, (sets.table_rate_dps, sets.temperature_c), _cells(c), strict=True):
            shown = np.array(columns[level])[axis == a]
            yield figure("which data sets share a level", ranks(shown), cell[own])
            yield figure("levels of rate and temperature", shown, centres(of[own], cell[own]), ROUNDING)
    for name, which in (("turn_before_deg", 0), ("turn_after_deg", 1)):
        own = {a: full_turns(c.errors[a][which], sets.table_rate_dps, sets.temperature_c, sets.position,
                             np.array([up[-1] == a for up in sets.position])) for a in c.law.axes}  # fmt: skip
        yield figure("error of a full turn", columns[name], [own[a][k] for a, k in keys], TURNS * SMALL_DIFFERENCE)
    for kind, is_over_rate in (("over_rate", True), ("over_temperature", False)):
        for lines in answer[kind]:
            across, down = np.meshgrid(lines["at"], lines["level"])
            rate, warm = (across, down) if is_over_rate else (down, across)
            yield figure(
                "lines of the model", lines["error_dps"], _line(c, lines, rate.ravel(), warm.ravel()), EIGHT_DIGITS
            )


def _cells(c: Compared) -> tuple[Any, Any]:
    """Return column and row, (n,) each, of the data sets in a map of rate and temperature."""
    return map_cells(c.sets.table_rate_dps, c.sets.temperature_c, c.sets.position)


def _line(c: Compared, lines: Any, rate_dps: Any, temperature_c: Any) -> Any:
    """Return the error of the model where the table turns at rates in the position of a line."""
    up = lines["position"]
    sign, along = (-1.0 if up.startswith("-") else 1.0), [axis == up[-1] for axis in c.law.axes]
    true = sign * (rate_dps + c.sets.earth_dps)[:, None] * np.array(along)
    return c.law.error(true, temperature_c)[:, c.law.axes.index(lines["axis"])]


def _maps(c: Compared, maps: Any, fitted: Any) -> Iterator[Row]:
    """Yield the cells of the residual maps; all maps of an axis have the same levels."""
    place = {int(number): k for k, number in enumerate(c.sets.number)}
    floor = c.get(f"{c.path}/criticism")["error"]["noise_floor_dps"]
    floors = []
    for part in maps:
        rows = [place[n] for n in part["dataset"]]
        yield figure("residual map", part["residual_dps"], fitted[part["axis"]][rows], SMALL_DIFFERENCE)
        yield figure("rates and temperatures of the map", [part["table_rate_dps"], part["temperature_c"]],
                     [c.sets.table_rate_dps[rows], c.sets.temperature_c[rows]], PIECES)  # fmt: skip
        floors += [r / o for r, o in zip(part["residual_dps"], part["over_floor"], strict=True) if o]
    for axis in {part["axis"] for part in maps}:
        own = [part for part in maps if part["axis"] == axis]
        rows = [place[n] for part in own for n in part["dataset"]]
        for level, of, cell in zip(LEVELS, ("table_rate_dps", "temperature_c"), _cells(c), strict=True):
            shown, values = (np.concatenate([part[name] for part in own]) for name in (level, of))
            yield figure("which data sets share a cell of the map", ranks(shown), cell[rows])
            yield figure("levels of the map", shown, centres(values, cell[rows]), ROUNDING)
    if floors:
        yield figure("noise floor of a mean, from the map", [floor], [rms(np.array(floors))], SMALL_DIFFERENCE)


def _sets(c: Compared, shown: Any, fitted: Any) -> Iterator[Row]:
    """Yield what the pictures of the residual against channels are drawn from, of five digits."""
    place = {int(number): k for k, number in enumerate(c.sets.number)}
    rows = [place[n] for n in shown["dataset"]]
    for axis, values in shown["residual_dps"].items():
        yield figure("residual against channels", values, fitted[axis][rows], FIVE_DIGITS)
    for name, values in shown["channels"].items():
        own = _channel(c, name)
        if own is not None:
            yield figure("channels of the residual", values, own[rows], FIVE_DIGITS)


def _channel(c: Compared, name: str) -> Any:
    sets = c.sets
    if name == "table_rate_dps":
        return sets.table_rate_dps
    if name == "order":
        return np.arange(1.0, len(sets.number) + 1)
    if name == "previous_rate_dps":
        return np.concatenate([[0.0], sets.table_rate_dps[:-1]])
    return sets.mean.get(name)


def _where(c: Compared, shown: list[dict[str, Any]], fitted: Any) -> Iterator[Row]:
    """Yield the RMS of the residual in each part of a channel that the page names."""
    for part in shown:
        values = _channel(c, part["channel"])
        if values is not None:
            inside = (values >= part["from"] - 1e-9) & (values <= part["to"] + 1e-9)
            own = float(np.sqrt(np.mean(fitted[part["axis"]][inside] ** 2)))
            yield figure("RMS where the error is largest", [part["rms_dps"]], [own], SMALL_DIFFERENCE)

"""The library of shapes: formulas of channels in their own range, with constants that can be moved."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from labctl.fitting.criticism.laws.shapes import FASTEST_PHASE, Scale, Shape, library
from labctl.fitting.effects.formula import read_formula

RATE = Scale("table_rate_dps", "(rate_dps/100)", 0.05)
TEMPERATURE = Scale("temperature_c", "((temperature_c - 20)/30)", 0.05)


def test_every_formula_of_the_library_can_be_given_to_a_model() -> None:
    formulas = [
        text for shape in library({"table_rate_dps": RATE, "temperature_c": TEMPERATURE}) for text in shape.formulas()
    ]
    assert len(formulas) == len({read_formula(f"law: {text}").text for text in formulas}) > 300


def test_a_law_without_a_rate_has_no_shape_of_it() -> None:
    texts = [text for shape in library({"temperature_c": TEMPERATURE}) for text in shape.formulas()]
    assert texts
    assert not any("rate" in text for text in texts)


def test_constants_are_written_with_three_digits_and_negative_ones_in_brackets() -> None:
    shape = Shape("step", ("tanh(({u} - {k})/{w})",), {"k": -0.25, "w": 0.1}).of("x")
    assert shape.formulas() == ("tanh((x - (-0.25))/0.1)",)
    assert shape.formulas({"w": 0.123456}) == ("tanh((x - (-0.25))/0.123)",)
    assert shape.times("y", "times y").formulas() == ("y * tanh((x - (-0.25))/0.1)",)


def test_constants_move_about_where_they_begin() -> None:
    for shape in library({"table_rate_dps": RATE, "temperature_c": TEMPERATURE}):
        assert set(shape.bounds) == set(shape.constants)
        for name, (low, high) in shape.bounds.items():
            assert low <= shape.constants[name] <= high
            assert low < high
            assert name == "k" or np.sign(low) == np.sign(high)


@pytest.mark.parametrize("gap", [0.05, 0.2, 0.5])
def test_no_shape_is_narrower_or_faster_than_the_values_show(gap: float) -> None:
    shapes = library({"table_rate_dps": replace(RATE, gap=gap), "temperature_c": replace(TEMPERATURE, gap=gap)})
    widths = [shape.bounds["w"][0] for shape in shapes if "w" in shape.bounds]
    phases = [shape.bounds["f"][1] * gap for shape in shapes if "f" in shape.bounds]
    assert min(widths) >= gap
    assert 0 < max(phases) <= FASTEST_PHASE * (1 + 1e-9)

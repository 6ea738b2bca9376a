"""Shares and coefficients of a verdict, from columns that are known."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from labctl.fitting.criticism.evidence.design import EliminatedBase
from labctl.fitting.criticism.evidence.noise_grid import Noise
from labctl.fitting.criticism.ranking import Candidate
from labctl.fitting.criticism.verdict import coefficients_of, overlap

#: Columns of two options of one, and one option of two columns; the second is 30 degrees from the first.
COLUMNS = np.array([[2.0, 0.0, 0.0, 0.0], [np.cos(np.pi / 6), np.sin(np.pi / 6), 0, 0], [0, 0, 1, 0], [0, 0, 0, 3]]).T
SLICES = [slice(0, 1), slice(1, 2), slice(2, 4)]


def compared(**data: list[float]) -> Any:
    """A comparison whose options have these columns, with the data of each axis; without a base."""
    axes, designs = {}, {}
    for axis, values in data.items():
        found = np.array(values)
        best = EliminatedBase(
            Noise(0.0, 0.0, 0.0), 0.0, COLUMNS.T @ COLUMNS, (COLUMNS**2).sum(axis=0), COLUMNS.T @ found,
            float(found @ found),
        )  # fmt: skip
        axes[axis] = SimpleNamespace(best=best, slices=SLICES)
        two = SimpleNamespace(names=("a", "time_constant"), units=("deg/s", "s"))
        one = SimpleNamespace(names=("a",), units=("deg/s",))
        designs[axis] = SimpleNamespace(options=[one, one, two])
    return SimpleNamespace(axes=axes, designs=designs)


def candidate(**options: int) -> Candidate:
    return Candidate("bias", False, 9.0, options, None, 9.0)


def test_an_overlap_is_the_squared_cosine_between_two_signals() -> None:
    comparison = compared(z=[5.0, 0.0, 0.0, 0.0])
    assert overlap(comparison, candidate(z=0), candidate(z=0)) == pytest.approx(1.0)
    assert overlap(comparison, candidate(z=0), candidate(z=1)) == pytest.approx(np.cos(np.pi / 6) ** 2)
    assert overlap(comparison, candidate(z=0), candidate(z=2)) == 0.0


def test_an_overlap_over_axes_is_that_of_the_whole_signal() -> None:
    """Of 9 on x and 0.25 on z; an axis on which the rival has no shape is not reproduced."""
    comparison = compared(x=[3.0, 0.0, 0.0, 0.0], z=[0.5, 0.0, 0.0, 0.0])
    both = candidate(x=0, z=0)
    assert overlap(comparison, both, candidate(x=0)) == pytest.approx(9.0 / 9.25)
    assert overlap(comparison, both, candidate(z=1)) == pytest.approx(0.25 * 0.75 / 9.25)
    assert overlap(comparison, candidate(z=0), candidate(z=0)) == pytest.approx(1.0)


def test_of_no_signal_nothing_is_reproduced() -> None:
    assert overlap(compared(z=[0.0, 0.0, 0.0, 0.0]), candidate(z=0), candidate(z=0)) == 0.0


def test_coefficients_have_value_uncertainty_and_unit_on_each_axis_and_what_is_derived_of_them() -> None:
    """In units of the noise: a column of size s, with data d along it, has the value d/s and the uncertainty 1/s."""
    found = coefficients_of(compared(x=[3.0, 0, 0, 0], z=[0, 0, 1.5, 6.0]), candidate(x=0, z=2))
    assert list(found) == ["x", "z"]
    assert found["x"] == {"a": {"value": pytest.approx(1.5), "u": pytest.approx(0.5), "unit": "deg/s"}}
    assert list(found["z"]) == ["a", "time_constant", "bandwidth"]
    assert found["z"]["a"] == {"value": pytest.approx(1.5), "u": pytest.approx(1.0), "unit": "deg/s"}
    assert found["z"]["time_constant"] == {"value": pytest.approx(2.0), "u": pytest.approx(1 / 3), "unit": "s"}
    assert found["z"]["bandwidth"]["value"] == pytest.approx(1 / (2 * np.pi * 2.0))

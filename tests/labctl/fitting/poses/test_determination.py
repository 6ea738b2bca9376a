"""Turns that leave a coefficient undetermined are refused with the turn that is missing."""

from __future__ import annotations

import numpy as np
import pytest

from labctl.errors import NotEnoughData
from labctl.fitting import fit
from labctl.fitting.poses.determination import require_moves
from labctl.fitting.poses.moves import Moves
from labctl.recording import Recording
from studies.poses_simulation import Session, simulate_session


def without_turns_about(axis: int, seed: int) -> Recording:
    """Return a session with turns about two axes of the body only, from a start in which both tilt gravity."""
    turned = tuple(each for each in range(3) if each != axis)
    recording, _ = simulate_session(seed, Session(rests=30, axes_turned=turned))
    return recording


@pytest.mark.parametrize("axis", [0, 2])
def test_a_missing_axis_is_named(axis: int) -> None:
    name = "xyz"[axis]
    with pytest.raises(NotEnoughData, match=rf"turn about the {name} axis too, by 90 deg or more with {name} level"):
        fit(without_turns_about(axis, 3), "poses")


def test_too_few_usable_turns_say_why_the_others_are_not() -> None:
    m = 12
    moves = Moves(
        np.arange(m), np.zeros((m, 2)), np.zeros((m, 2, 3)), np.zeros((m, 1)), np.zeros((m, 2)), np.zeros(m),
        np.zeros(3), tuple("gyro_x is saturated at 250 deg/s: turn the unit more "
        "slowly" if k < 7 else "" for k in range(m)),
    )  # fmt: skip
    with pytest.raises(NotEnoughData, match=r"U: 5 turns .* at least 9 \(7 cannot: gyro_x is saturated at 250 deg/s"):
        require_moves("U", moves)

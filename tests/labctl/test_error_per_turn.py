"""Error after a full turn, and the static bias before a mission."""

from __future__ import annotations

import numpy as np
import pytest

from labctl.error_per_turn import error_per_turn, static_bias
from labctl.errors import BadInput, NotEnoughData


def test_error_per_turn_is_error_times_time() -> None:
    assert error_per_turn(np.array([0.1, 0.1]), np.array([10.0, -90.0])) == pytest.approx([3.6, 0.4])
    with pytest.raises(BadInput, match="rate 4 deg/s"):
        error_per_turn(np.array([0.1]), np.array([4.0]))


def test_static_bias_says_how_well_it_is_known() -> None:
    rng = np.random.default_rng(1)
    at_rest = 0.02 + rng.normal(0, 0.0044, 100)
    found = static_bias(at_rest, instability_dps=0.002)
    assert found.bias_dps == pytest.approx(0.02, abs=3 * found.u_dps)
    assert found.u_dps == pytest.approx(np.hypot(0.00044, 0.002), rel=0.1)
    with pytest.raises(NotEnoughData, match="at least 10"):
        static_bias(at_rest[:5])

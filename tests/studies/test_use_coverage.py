"""The study of the uncertainty in use: every place has a score, and the scores are of order one."""

from __future__ import annotations

import numpy as np
import pytest

from studies.use_coverage import CONVENTIONS, MODELS, PLACES, scores


@pytest.mark.slow
def test_a_unit_is_scored_at_every_place_by_every_model_and_by_every_convention_of_the_data_sheet() -> None:
    found = scores(1)
    assert len(found) == (2 * len(MODELS) + len(CONVENTIONS) - 1) * len(PLACES)
    values = np.abs([value for values in found.values() for value in values])
    assert np.all(np.isfinite(values))
    assert 0.025 < np.median(values) < 1.5

"""Advice on a public rate-table record of which the last third in time is put aside."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from labctl.fitting.criticism.advice import advice_for
from labctl.fitting.criticism.search.refinement import refined_term
from labctl.recording import Recording
from studies.public_records import criticised, parts_of, recording_of, said


@pytest.fixture(scope="module")
def first_two_thirds() -> Recording:
    whole = recording_of("osu-rate-table.csv", "osu-rate-table")
    aside = dict(parts_of(whole))["last third"]
    return replace(whole, columns={name: np.asarray(values)[~aside] for name, values in whole.columns.items()})


def test_a_sine_is_advised_where_it_takes_nine_tenths_of_the_error(first_two_thirds: Recording) -> None:
    _, found = criticised(first_two_thirds, "bias_scale")
    assert said(found)[2] == ("sine_response",)


@pytest.mark.slow
def test_a_gain_that_scatters_from_part_to_part_is_not_advised(first_two_thirds: Recording) -> None:
    """The sine beside a cubic gains 1 % on parts left out; on the last third it would lose 2 %."""
    base, found = criticised(first_two_thirds, "ojeda2000")
    assert said(found)[2] == ()
    assert found.comparison is not None
    sine = next(each for each in found.comparison.candidates if each.id == "sine_response")
    (advice,) = advice_for(found.fit_data, base.fitted.model.forward(), [refined_term(found.comparison, sine)])
    assert not advice["add"]
    before_dps, after_dps = advice["before_dps"], advice["after_dps"]
    assert before_dps is not None
    assert after_dps is not None
    assert 0.98 * before_dps < after_dps < 0.99 * before_dps
    assert "from part to part the difference scatters by more" in advice["why"]

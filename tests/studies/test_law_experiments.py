"""The study that measures what labctl asks for to test a law: what is measured, for how long, and what is counted."""

from __future__ import annotations

import numpy as np
import pytest

from labctl.services.planning.loading import load_recipe
from studies import law_experiments
from studies.law_experiments import Followed, Measured, table
from studies.laws import PUBLISHED, Case, Outcome, Proposal, recorded_by

CASE = Case("single-axis", 4700, "scale_etalon", 30.0)


def test_what_was_measured_is_measured_with_more_readings_until_the_hours_are_spent(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    measured = Measured(CASE, [], [], [], [])
    assert measured.measure("temperature_c")
    assert measured.measure("table_rate_dps")
    assert [recipe.repeats for recipe in measured.done] == [1, 1]
    spent_h = measured.hours
    monkeypatch.setattr(law_experiments, "MAX_HOURS", spent_h)
    assert not measured.measure("table_rate_dps")
    assert (measured.hours, measured.channels) == (spent_h, ["temperature_c", "table_rate_dps"])
    halfway_c = measured.done[0].temperatures_c
    assert not {*halfway_c} & {*load_recipe(PUBLISHED[0]).temperatures_c}
    set_points_c = np.asarray(measured.plain[0].columns["chamber_setpoint_c"], dtype=np.float64)
    assert np.unique(set_points_c) == pytest.approx(sorted(halfway_c))
    for plain, part in zip(measured.plain, measured.parts, strict=True):
        assert float(np.ptp(part.gyro_dps("z") - plain.gyro_dps("z"))) > 0


def test_a_day_has_a_noise_of_its_own() -> None:
    recipe = load_recipe(PUBLISHED[0]).model_copy(update={"temperatures_c": (30.0,)})
    one, same, other = (recorded_by(recipe, PUBLISHED[1], 4700, day).gyro_dps("z") for day in (2, 2, 3))
    assert np.array_equal(one, same)
    assert not np.array_equal(one, other)


def test_the_nearest_of_the_proposals_is_counted_beside_the_likeliest() -> None:
    far, near = (Proposal(("f",), 0.5, error, error, 0.5) for error in (0.2, 0.05))
    found = [
        Followed(Outcome(CASE, "unexplained", proposals=proposals, known_form=0.01), ("temperature_c",), 4.0)
        for proposals in ((far, near), (near, far), (far,), ())
    ]
    shares = {row.split("|")[1].strip(): row.split("|")[-2].split()[0] for row in table(found).splitlines()[2:]}
    assert shares["likeliest within 10 % on the other recording"] == "25"
    assert shares["one of five within 10 % on the other recording"] == "50"
    assert shares["median hours beyond the first recording"] == "4.0"

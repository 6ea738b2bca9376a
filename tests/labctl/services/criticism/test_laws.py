"""Laws in the answer of a criticism: in words, with their figures, and as formulas that a model can take."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from labctl.answers.calibrations import FitRequest, ImproveRequest
from labctl.errors import BadInput
from labctl.fitting.criticism import criticise
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.models.presets import preset_for
from labctl.services.calibrations.fitting import fit_unit
from labctl.services.calibrations.revision import improve_unit
from labctl.services.criticism.criticise import criticise_unit, write_next
from labctl.services.criticism.laws import proposed_laws
from labctl.services.criticism.next_experiment import law_tests, recipe_for_laws
from labctl.services.planning.loading import load_bench, load_recipe
from labctl.store import Store, open_store
from procedures.recipe.recipe import parse_recipe
from tests.helpers.diagnoses import criticism
from tests.helpers.simulated_recordings import single_axis
from tests.helpers.unnamed_error import SIZE_DPS, with_wave

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Store]:
    folder: Path = tmp_path_factory.mktemp("laws")
    with open_store(str(folder / "lab.sqlite"), write=True) as opened:
        recording = with_wave(single_axis(3))
        opened.recordings.add_import(recording, recording.info.started_at)
        fit_unit(opened, recording.info.serial, FitRequest(model="ojeda2000"), AT)
        yield opened


@pytest.mark.slow
def test_an_unexplained_residual_has_a_law_that_the_model_can_take(store: Store) -> None:
    (unit,) = store.units.all()
    found = criticise_unit(store, unit.serial, 1, None)
    assert found.verdict == "unexplained"
    law = found.laws[0]
    assert found.law_test is not None
    assert "half-way between the rates of the recordings" in found.law_test["do"]
    halfway = np.array(parse_recipe(found.law_test["toml"]).rates_dps)
    assert not np.any(np.isclose(np.abs(halfway) % 20.0, 0.0))  # between the rates of Ojeda's schedule
    coefficient = law["coefficients"]["z"]["law_1"]
    assert coefficient["value"] == pytest.approx(SIZE_DPS, rel=0.05)
    assert law["equations"]["z"].startswith(f"{coefficient['value']:.4g} * sin(")
    improved = improve_unit(store, unit.serial, ImproveRequest(formula=law["formulas"], version=1), AT)
    assert improved.error.rms_dps == pytest.approx(law["rms_after_dps"], rel=1e-6)
    after = criticise_unit(store, unit.serial, improved.version, None)
    assert after.verdict == "adequate"
    assert after.laws == []


def test_the_recipe_that_tests_laws_measures_half_way_between_the_rates(store: Store, tmp_path: Path) -> None:
    recording = single_axis(3)
    model, _ = preset_for("ojeda2000", []).build(fit_data_of(recording))
    criticised = criticise(recording, model, full=False)
    toml = recipe_for_laws(store, store.recordings.of_unit("FOG-0001"), criticised, "table_rate_dps")
    rates = np.unique(np.round(np.asarray(recording.columns["table_rate_dps"], dtype=np.float64), 1)).tolist()
    halfway = [(low + high) / 2 for low, high in pairwise(rates)]
    assert sorted(parse_recipe(toml).rates_dps) == pytest.approx(halfway, abs=0.05)
    test = {"rate_dps": 96.0, "temperature_c": None, "difference_dps": 0.002, "do": "measure", "toml": toml}
    unexplained = criticism("unexplained")
    write_next(unexplained.model_copy(update={"law_test": test}), tmp_path / "next.toml")
    assert (tmp_path / "next.toml").read_text(encoding="utf-8") == toml
    with pytest.raises(BadInput, match="no recipe was written"):
        write_next(unexplained, tmp_path / "none.toml")


@pytest.mark.parametrize(("channel", "block"), [
    ("table_rate_dps", "between_rates"), ("temperature_c", "between_temperatures"),
])  # fmt: skip
def test_a_law_is_tested_between_the_levels_of_the_channel_over_which_it_bends_and_then_with_more_readings(
    channel: str, block: str
) -> None:
    recipe, bench = load_recipe("ojeda2000-121"), load_bench("single-axis-sim")
    first, *longer = law_tests(recipe, bench, channel)
    assert {each.block.id for each in (first, *longer)} == {block}
    assert first.plan.recipe.repeats == 1
    assert [each.plan.recipe.repeats for each in longer][:1] == [4]
    assert [each.plan.recipe for each in law_tests(recipe, bench, channel, [first.plan.recipe])] == [
        each.plan.recipe for each in longer
    ]


def test_where_no_law_is_proposed_no_recipe_is_made() -> None:
    recording = single_axis(3)
    model, _ = preset_for("ojeda2000", []).build(fit_data_of(recording))
    asked: list[str] = []
    found = criticise(recording, model, full=False)
    assert proposed_laws(found, lambda channel: asked.append(channel) or "") == ([], None)
    assert asked == []

"""The prior of a type: in a fit, which states it, and in a design, whose recipe is fitted with it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from labctl.answers.calibrations import FitRequest
from labctl.answers.design import DesignRequest
from labctl.calibration import read_calibration
from labctl.cli.printing.calibrations import print_fit
from labctl.cli.printing.design import print_design
from labctl.errors import BadInput, NotEnoughData, NotFound
from labctl.recording import Recording
from labctl.services.calibrations.fitting import fit_unit, fitted_unit, one_version
from labctl.services.certificates.assembly import statements
from labctl.services.certificates.facts import Facts
from labctl.services.design.design import design_campaign
from labctl.services.design.type_prior import MIN_UNITS, prior_of_type
from labctl.services.planning.loading import load_bench
from labctl.store import Store, open_store
from procedures.recipe.recipe import parse_recipe
from tests.helpers.fleets import AT, run_job, unit_points

WITH, ALONE = FitRequest(model="bias_scale", type_prior=True), FitRequest(model="bias_scale")
NEW, OTHER = 50, 51


def about_z(recording: Recording) -> Recording:
    """Return the recording of a unit that measures about z, as the units of the simulated single-axis bench do."""
    columns = {name.replace("_x", "_z"): values for name, values in recording.columns.items()}
    columns["position"] = np.full(len(columns["dataset"]), "z")
    return Recording(recording.info.model_copy(update={"axes": ("z",)}), columns)


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Store]:
    """Return a store with a calibrated type, and two units of it that are not fitted: a usual one and a wild one."""
    with open_store(str(tmp_path_factory.mktemp("prior") / "lab.sqlite"), write=True) as opened:
        for number in range(MIN_UNITS):
            opened.recordings.add_import(unit_points(number), AT)
        assert run_job(opened, type="FOG-A", model="bias_scale", effects=[]).done == MIN_UNITS
        opened.recordings.add_import(unit_points(NEW), AT)
        wild = unit_points(OTHER)
        warm = np.asarray(wild.columns["temperature_c"], dtype=np.float64)
        bent = np.asarray(wild.columns["gyro_x"], dtype=np.float64) + 0.02 * (warm - 20.0)
        opened.recordings.add_import(replace(wild, columns={**wild.columns, "gyro_x": bent}), AT)
        for number in range(60, 63):
            opened.recordings.add_import(unit_points(number, "MEMS-B"), AT)
        assert run_job(opened, type="MEMS-B", model="bias_scale", effects=[]).done == 3
        for number in range(70, 70 + MIN_UNITS):
            opened.recordings.add_import(about_z(unit_points(number, "FOG-Z")), AT)
        assert run_job(opened, type="FOG-Z", model="bias_scale", effects=[]).done == MIN_UNITS
        yield opened


def test_a_fit_with_the_prior_of_its_type_is_more_certain_and_says_where_it_is_from(
    store: Store, capsys: pytest.CaptureFixture[str]
) -> None:
    alone = fitted_unit(store, f"U{NEW:05d}", ALONE, AT).result.fitted.axes["x"]
    answer = fit_unit(store, f"U{NEW:05d}", WITH, AT)
    stated = answer.type_prior
    assert stated is not None
    assert (stated["type"], stated["model"], stated["units"], stated["is_used"]) == (
        "FOG-A", "bias_scale", MIN_UNITS, True,
    )  # fmt: skip
    document = read_calibration(store.calibrations.get(f"U{NEW:05d}", answer.version).document).document
    assert document["provenance"]["type_prior"] == stated
    assert one_version(store, f"U{NEW:05d}", answer.version).model_dump()["type_prior"] == stated
    fitted = read_calibration(store.calibrations.get(f"U{NEW:05d}", answer.version).document).fitted.axes["x"]
    for name in ("bias_t1", "scale_factor_t1", "scale_factor_t2"):  # no unit differs in these
        assert fitted.u_of(name) < 0.8 * alone.u_of(name)
        assert abs(fitted.value_of(name)) < 3.0 * fitted.u_of(name)
    assert fitted.u_of("scale_factor") < 1.05 * alone.u_of("scale_factor")
    again = prior_of_type(store, "FOG-A", "bias_scale", [])
    assert again.prior.units == MIN_UNITS  # a version that was fitted with a prior is no evidence for the next one
    assert again.versions_hash == stated["versions_hash"]
    facts = SimpleNamespace(simulated=False, calibration=SimpleNamespace(document=document), authorised=None)
    (said,) = [text for text in statements(cast(Facts, facts)) if "of type FOG-A" in text]
    assert f"together with the calibrations of {MIN_UNITS} other units" in said
    print_fit(answer)
    assert f"prior              {MIN_UNITS} other units of type FOG-A by bias_scale" in capsys.readouterr().out


def test_a_unit_that_is_not_like_its_type_is_fitted_alone_and_says_so(store: Store) -> None:
    alone = fitted_unit(store, f"U{OTHER:05d}", ALONE, AT).result.fitted.axes["x"]
    fitted = fitted_unit(store, f"U{OTHER:05d}", WITH, AT)
    stated = fitted.build(1).answer["type_prior"]  # type: ignore[typeddict-item]
    assert not stated["is_used"]
    assert stated["p_value"] < 1e-3
    assert fitted.result.fitted.axes["x"].values == pytest.approx(alone.values)


def test_a_type_with_too_few_units_or_without_the_model_gives_no_prior(store: Store) -> None:
    with pytest.raises(NotEnoughData, match=r"type 'MEMS-B' has 3 other units .* takes at least 10; calibrate more"):
        prior_of_type(store, "MEMS-B", "bias_scale", [])
    with pytest.raises(NotEnoughData, match="has 0 other units with comparable calibrations by model ojeda2000"):
        fitted_unit(store, f"U{NEW:05d}", FitRequest(model="ojeda2000", type_prior=True), AT)
    with pytest.raises(BadInput, match="the unit has no type; state its model"):
        prior_of_type(store, "", "bias_scale", [])
    with pytest.raises(NotFound, match="no unit matches type 'FOG-Q'; `labctl units`"):
        prior_of_type(store, "FOG-Q", "bias_scale", [])


@pytest.mark.slow
def test_a_design_with_the_prior_takes_no_longer_and_its_recipe_is_fitted_with_it(
    store: Store, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = {"like": "ojeda2000", "model": "bias_scale", "u_dps": 0.01, "type_prior": "FOG-Z"}
    answer = design_campaign(store, DesignRequest.model_validate(asked), load_bench("single-axis-sim"))
    prior = answer.type_prior
    assert prior is not None
    assert (prior.type, prior.units) == ("FOG-Z", MIN_UNITS)
    assert prior.without is not None
    assert answer.chosen.hours <= prior.without.hours
    assert answer.chosen.u_worst_dps < 0.99 * prior.without.u_worst_dps
    rules = parse_recipe(answer.recipe_toml).fit
    assert rules is not None
    assert rules.type_prior
    print_design(answer, Path("mine.toml"))
    printed = " ".join(capsys.readouterr().out.split())
    assert f"with the prior of {MIN_UNITS} units of type FOG-Z by bias_scale: {answer.chosen.hours:.1f} h" in printed
    assert f"without it {prior.without.hours:.1f} h" in printed


def test_a_prior_of_other_outputs_than_the_recipe_measures_is_refused(store: Store) -> None:
    asked = DesignRequest(like="ojeda2000", model="bias_scale", u_dps=0.01, type_prior="FOG-A")
    with pytest.raises(BadInput, match=r"type 'FOG-A': its calibrated units have output x, but .* output z,"):
        design_campaign(store, asked, load_bench("single-axis-sim"))

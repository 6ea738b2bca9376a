"""A campaign with turned mountings on a bench that is off: what was fitted holds, and so do its other documents."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from labctl.answers.calibrations import FitRequest
from labctl.fitting.data.fit_data import fit_data_of
from labctl.recording import Recording, to_points
from labctl.services.calibrations.fitting import fit_unit
from labctl.services.criticism.verification.of_version import verify_unit
from labctl.services.datasheet.measured import figures_of
from labctl.services.planning.loading import limits_of, load_bench, load_recipe
from labctl.services.simulation.plan_simulation import hidden_recording
from labctl.store import open_store
from procedures.planning.plan import make_plan
from procedures.recipe.rules import Indexing, Verification
from tests.helpers.certificates import AT

MODEL = FitRequest(effects=["bias", "bias_temperature", "scale_factor", "scale_factor_temperature", "misalignment"])


@pytest.fixture(scope="module")
def recorded() -> Recording:
    """A tri-axial unit on a bench whose fixture, table and mountings are drawn from what they are stated as."""
    named = load_bench("triaxial-sim")
    assert named.simulation is not None
    bench = named.model_copy(update={"simulation": named.simulation.model_copy(update={"draw_standards": True})})
    turned = {"unit_deg": (180,), "temperatures_c": (25.0,), "rates_dps": (400.0, -400.0), "hold_s": 0.0}
    recipe = load_recipe("quick-triaxial").model_copy(
        update={"indexing": Indexing.model_validate(turned), "verification": Verification(temperatures=1, rates=5)}
    )
    gyro = bench.gyros[0].model_copy(update={"sample_rate_hz": 4.0})
    return to_points(hidden_recording(make_plan(recipe, limits_of(bench)), bench, gyro, 3, {}))


def test_the_version_holds_on_its_verification_part(recorded: Recording, tmp_path: Path) -> None:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        store.recordings.add_import(recorded, AT)
        fit_unit(store, "STIM-0001", MODEL, AT)
        found = verify_unit(store, "STIM-0001", 1, None)
    assert found.part == "verification"
    assert (found.ok, found.axes_off) == (True, [])
    placed_dps = 400.0 * math.radians(0.002)  # of a mounting, standard
    assert found.expected_dps is not None
    assert found.max_dps < 4.0 * placed_dps + 3.0 * found.expected_dps


def test_the_data_sheet_leaves_turned_mountings_out(recorded: Recording) -> None:
    data = fit_data_of(recorded)
    turned = np.char.find(np.asarray(data.channels["position"]).astype(str), "@") > 0
    assert turned.sum() == 6
    figures = {(each.id, each.axis): each for each in figures_of(data)}
    for figure in figures.values():
        assert figure.rows.shape == (len(data),)
        assert not np.any(figure.rows & turned)
    assert figures["scale_factor_nonlinearity", "x"].estimate.value > 0
    assert figures["misalignment", "x"].estimate.u is not None

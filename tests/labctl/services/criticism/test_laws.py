"""Laws in the answer of a criticism: in words, with their figures, and as formulas that a model can take."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

import pytest

from labctl.answers.calibrations import FitRequest, ImproveRequest
from labctl.services.calibrations.fitting import fit_unit
from labctl.services.calibrations.revision import improve_unit
from labctl.services.criticism.criticise import criticise_unit
from labctl.store import Store, open_store
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
    coefficient = law["coefficients"]["z"]["law_1"]
    assert coefficient["value"] == pytest.approx(SIZE_DPS, rel=0.05)
    assert law["equations"]["z"].startswith(f"{coefficient['value']:.4g} * sin(")
    improved = improve_unit(store, unit.serial, ImproveRequest(formula=law["formulas"], version=1), AT)
    assert improved.error.rms_dps == pytest.approx(law["rms_after_dps"], rel=1e-6)
    after = criticise_unit(store, unit.serial, improved.version, None)
    assert after.verdict == "adequate"
    assert after.laws == []

"""What a criticism says of every candidate of one unit, for the criticism of its type."""

from __future__ import annotations

import numpy as np
import pytest

from labctl.fitting.criticism import candidate_estimates, criticise
from labctl.fitting.criticism.evidence.gains import solve_option
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.fleet.type_evidence import UnitEvidence, type_evidence
from labctl.fitting.models.presets import preset_for
from tests.helpers.simulated_recordings import single_axis


def test_estimates_are_those_of_the_comparison_and_units_add_up() -> None:
    recording = single_axis(3)
    model, _ = preset_for("ojeda2000", []).build(fit_data_of(recording))
    found = criticise(recording, model, full=False)
    estimates = candidate_estimates(found)["z"]
    comparison = found.beside_missing
    assert comparison is not None
    assert len(estimates.z) == sum(len(shape.names) for shape in estimates.shapes)
    assert np.diag(estimates.overlap) == pytest.approx(1.0)
    assert len({shape.key for shape in estimates.shapes}) == len(estimates.shapes)
    begin = compared = 0
    for shape in estimates.shapes:
        own = slice(begin, begin + len(shape.names))
        begin = own.stop
        every = zip(comparison.designs["z"].options, comparison.axes["z"].slices, strict=True)
        solved = [
            solve_option(comparison.axes["z"].best, rows)
            for option, rows in every
            if option.candidate == shape.effect and option.names == shape.names and len(shape.names) == 1
        ]
        if solved:
            compared += 1
            assert any(
                estimates.z[own] * estimates.u[own] == pytest.approx(value, rel=1e-6)
                and estimates.u[own] ** 2 == pytest.approx(np.diag(covariance), rel=1e-6)
                for value, covariance in solved
            ), shape
    assert compared > 20
    same = type_evidence([UnitEvidence(f"U{i}", {"z": estimates}) for i in range(5)])
    assert same.units == 5
    assert {each.effect for each in same.candidates} == {shape.effect for shape in estimates.shapes}

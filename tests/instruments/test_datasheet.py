"""What a figure of a data sheet means: the standard uncertainty of each convention, and the defaults of the makers."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from instruments.bench_config import GyroSettings, shipped_benches
from instruments.datasheet import DatasheetFigure, datasheet_figure
from labctl.errors import BadInput
from labctl.services.planning.loading import load_bench


@pytest.mark.parametrize(
    ("convention", "u", "drawn"),
    [
        ("1 sigma", 0.002, lambda rng, n: rng.normal(0, 0.002, n)),
        ("maximum", 0.002 / math.sqrt(3), lambda rng, n: rng.uniform(-0.002, 0.002, n)),
        ("peak to peak", 0.001 / math.sqrt(3), lambda rng, n: rng.uniform(-0.001, 0.001, n)),
        ("typical", 0.00296, lambda rng, n: rng.normal(0, 0.00296, n)),
    ],
)
def test_u_is_the_standard_deviation_of_what_the_convention_says(convention: Any, u: float, drawn: Any) -> None:
    figure = DatasheetFigure("bias_stability_dps", 0.002, convention, "")
    assert figure.u == pytest.approx(u)
    errors = drawn(np.random.default_rng(3), 400_000)
    assert figure.u == pytest.approx(float(errors.std()), rel=0.01)
    assert figure.text.startswith(f"bias stability 0.002 deg/s, {convention}: ")


def test_half_of_the_units_are_within_a_typical_figure() -> None:
    errors = DatasheetFigure("bias_stability_dps", 0.002, "typical", "").u * np.random.default_rng(4).normal(
        size=400_000
    )
    assert float(np.mean(np.abs(errors) <= 0.002)) == pytest.approx(0.5, abs=0.003)


@pytest.mark.parametrize(
    ("model", "name", "convention", "source"),
    [
        ("KVH E-Core RD2100", "bias_stability_dps", "1 sigma", "Table I"),
        ("KVH DSP-3000", "bias_repeatability_dps", "peak to peak", "Table I"),
        ("Sensonor STIM300", "bias_stability_dps", "typical", "TS1524"),
        ("Acme G1", "bias_stability_dps", "1 sigma", "no convention is stated"),
        ("", "bias_repeatability_dps", "1 sigma", "no convention is stated"),
    ],
)
def test_without_a_convention_the_makers_own_sheet_holds_and_is_named(
    model: str, name: str, convention: str, source: str
) -> None:
    figure = datasheet_figure(name, {name: 0.002}, {}, model)
    assert figure is not None
    assert figure.convention == convention
    assert source in figure.text
    stated = datasheet_figure(name, {name: 0.002}, {name: "maximum"}, model)
    assert stated is not None
    assert (stated.convention, source in stated.text) == ("maximum", False)


def test_a_figure_that_is_not_there_or_zero_is_none() -> None:
    assert datasheet_figure("bias_stability_dps", {}, {}, "KVH DSP-3000") is None
    assert datasheet_figure("bias_stability_dps", {"bias_stability_dps": 0.0}, {}, "") is None


@pytest.mark.parametrize(
    ("stated", "said"),
    [
        ('{ bias_stability_dps = "2 sigma" }', "'1 sigma', 'maximum', 'peak to peak' or 'typical'"),
        (
            '{ bias_dps = "1 sigma" }',
            "bias_dps: the data sheet has no such figure; state it in datasheet, or remove it",
        ),
    ],
)
def test_a_wrong_convention_of_a_bench_file_is_named(tmp_path: Path, stated: str, said: str) -> None:
    shipped = shipped_benches()["single-axis-sim"].read_text(encoding="utf-8")
    file = tmp_path / "bench.toml"
    file.write_text(re.sub("datasheet_conventions = .*", f"datasheet_conventions = {stated}", shipped))
    with pytest.raises(BadInput, match="datasheet_conventions") as refused:
        load_bench(str(file))
    assert said in str(refused.value)


@pytest.mark.parametrize(
    "name",
    [
        "by-hand-sim",
        "servo-sim",
        "single-axis-sim",
        "triaxial-sim",
        "yang-paper-sim",
        "ojeda-paper-sim",
        "gyrostar-sim",
    ],
)
def test_every_figure_of_a_shipped_bench_has_a_convention(name: str) -> None:
    units: tuple[GyroSettings, ...] = load_bench(name).gyros
    for unit in units:
        assert set(unit.datasheet_conventions) == set(unit.datasheet)

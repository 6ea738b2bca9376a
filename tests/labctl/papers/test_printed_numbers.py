"""The printed numbers of the papers against each other: every contradiction follows from them, worked out apart."""

from __future__ import annotations

import re

import numpy as np
import pytest

from instruments.simulators.physics.unit_profiles import YANG_B_DPS, YANG_K, YANG_RATES_DPS, make_unit
from labctl.papers import PAPERS, weiss1995, yang2018
from tests.helpers.paths import ROOT


def stated(paper: str) -> str:
    return "\n".join(f"{c.place}: {c.statement} {c.decision}" for c in PAPERS[paper].contradictions)


def test_the_rates_of_yang_2018_are_21_in_print_and_23_in_its_errors() -> None:
    sizes = (0.1, 1, 10, 50, 100, 150, 200, 250, 300, 400)
    printed = np.array([0.0, *sizes, *(-s for s in sizes)])
    assert sorted(yang2018.RATES_DPS) == sorted(printed.tolist())
    rms = {n: float(np.sqrt(np.mean(np.square(r)))) for n, r in ((21, printed), (23, [*printed, 350.0, -350.0]))}
    said = stated("yang2018")
    for number in (f"{rms[21]:.1f}", f"{rms[23]:.1f}", f"{4.0177 / 0.0187:.1f}", "21", "23"):
        assert number in said
    assert (f"{rms[21]:.1f}", f"{rms[23]:.1f}", f"{4.0177 / 0.0187:.1f}") == ("192.1", "210.6", "214.9")


def test_four_cells_of_table_3_have_an_rms_below_their_mean_and_three_rows_of_table_4_are_means() -> None:
    said = stated("yang2018")
    assert "4 of 9 cells (x to y, x to z, y to z, z to y)" in said
    for value in ("-0.0307", "-0.0418", "-0.0292", "55.50, 75.36 and 48.33"):
        assert value in said
    assert "0.21 and 0.81 %" in said
    assert all(min(values) > 0 for turned in "xy" for values in yang2018.TABLE_4[turned].values())


def test_k_and_b_leave_about_a_tenth_of_a_deg_per_s_of_the_own_axes() -> None:
    for axis, before, bias, after in (("x", 0.1453, 0.0303, 0.0931), ("y", 0.1374, 0.0435, 0.0957)):
        left, low, high = yang2018.unexplained_dps(axis)
        assert left == pytest.approx(np.sqrt(before**2 - (5e-4 * 210.57) ** 2 - bias**2), abs=2e-4)
        assert low < left < high
        assert left == pytest.approx(after, abs=0.02)


def test_the_first_index_of_k_g_is_the_input() -> None:
    printed = dict(zip(yang2018.NAMES, yang2018.PROPOSED, strict=True))
    for turned, out in (("z", "y"), ("y", "z")):
        before = yang2018.TABLE_3[turned][out][1]
        first, second = (printed[name] * 210.6 for name in (f"K{turned}{out}", f"K{out}{turned}"))
        assert abs(first - before) < abs(second - before)
        assert f"{first:.2f} deg/s" in stated("yang2018")


def test_the_claims_of_weiss_do_not_hold_in_his_own_table() -> None:
    said = stated("weiss1995")
    low, high = weiss1995.scale_deviation_pct()
    assert (low, high) == pytest.approx((-0.0409, 0.3545), abs=1e-4)
    assert weiss1995.offset_slope(16, 23) == pytest.approx(0.61, abs=0.005)
    assert weiss1995.offset_slope(23, 45) == pytest.approx((2.549 - 2.525) / 0.022 / 22)
    for number in ("+0.3545 %", "0.61", "0.05", "+-0.15 %", "0.5 (deg/s)/K"):
        assert number in said


def test_the_simulated_unit_of_yang_2018_has_its_printed_coefficients_and_remainder() -> None:
    unit = make_unit("stim300", ("x", "y", "z"), {"profile": "yang-paper"}, [7])
    warm = np.full(len(YANG_RATES_DPS), 25.0)
    for turned in range(3):
        rates = np.zeros((len(warm), 3))
        rates[:, turned] = YANG_RATES_DPS
        assert unit.bend is not None
        output = np.einsum("nij,nj->ni", unit.gain(warm), rates) + unit.offset(warm) + unit.bend(rates, warm)
        found = np.linalg.lstsq(np.column_stack([YANG_RATES_DPS, np.ones(len(warm))]), output)[0]
        np.testing.assert_allclose(found[0], YANG_K[:, turned], atol=1e-9)
        np.testing.assert_allclose(found[1], YANG_B_DPS, atol=1e-9)
        rest = output[:, turned] - YANG_RATES_DPS * found[0, turned] - found[1, turned]
        assert np.sqrt(np.mean(rest**2)) == pytest.approx((0.0931, 0.0957, 0.0263)[turned], rel=0.02)
    named = dict(zip(yang2018.NAMES, yang2018.PROPOSED, strict=True))
    for out, row in zip("xyz", YANG_K, strict=True):
        for turned, value in zip("xyz", row, strict=True):
            assert abs(value) == pytest.approx(named[f"K{turned}{out}"])


def test_the_simulated_unit_of_yang_2018_changes_with_temperature_as_the_two_columns_of_k_g_say() -> None:
    unit = make_unit("stim300", ("x", "y", "z"), {"profile": "yang-paper"}, [7])
    gain, offset = (law(np.array([20.0, 25.0])) for law in (unit.gain, unit.offset))
    printed, single = (
        dict(zip(yang2018.NAMES, values, strict=True)) for values in (yang2018.PROPOSED, yang2018.TRADITIONAL)
    )
    rates = float(np.sqrt(np.mean(YANG_RATES_DPS**2)))
    for row, axis in enumerate("xyz"):
        change = float(gain[0, row, row] - gain[1, row, row])
        # each printed factor is rounded, 1.001 to three digits after the point
        assert change == pytest.approx(single[f"K{axis}{axis}"] - printed[f"K{axis}{axis}"], abs=2e-4)
        assert abs(float(offset[0, row])) == pytest.approx(single[f"B{axis}"], abs=2e-4)
        if axis != yang2018.MEANS:  # the traditional error is that of the proposed method and of the change
            before, left = yang2018.TABLE_4[axis][axis][1:]
            assert np.hypot(left, change * rates) == pytest.approx(before, rel=0.005)
    np.testing.assert_allclose(gain[0][~np.eye(3, dtype=bool)], gain[1][~np.eye(3, dtype=bool)])


def test_table_4_has_18_reductions_and_those_that_the_paper_prints_are_among_them() -> None:
    rows = {each.id: each for each in yang2018.PAPER.printed if each.place == "Table 4, reductions"}
    assert len(rows) == 18
    misprinted = {"x": {"y": 10.0, "z": 10.0}}
    for turned, outputs in yang2018.PRINTED_GAINS.items():
        for output, percentage in outputs.items():
            value = rows[f"gain_{turned}_{output}_traditional"].value
            by = misprinted.get(turned, {}).get(output, 1.0)
            assert value == pytest.approx(percentage / by, abs=0.02)
    assert rows["gain_x_x_traditional"].value == pytest.approx(26.75, abs=0.005)


def test_table_1_of_ojeda_2000_has_its_11_rows() -> None:
    rows = [each for each in PAPERS["ojeda2000"].printed if each.place == "Table I"]
    assert len(rows) == 11
    assert all(each.value is not None for each in rows)


def test_the_simulated_rd2100_of_the_paper_has_errors_that_no_surface_of_its_orders_follows() -> None:
    rate, warm = (grid.ravel() for grid in np.meshgrid(np.arange(-100.0, 101.0, 10.0), np.arange(25.0, 46.0, 2.0)))
    u, v = (warm - 35.0) / 10.0, rate / 100.0
    surface = np.column_stack([u**j * v**i for i in range(4) for j in range(3)])
    left = {}
    for profile in ("rd2100", "rd2100-paper"):
        unit = make_unit("kvh-rd2100", ("z",), {"profile": profile}, [1])
        assert unit.bend is not None
        error = rate * (unit.gain(warm)[:, 0, 2] - 1.0) + unit.offset(warm)[:, 0] + unit.bend(rate[:, None], warm)[:, 0]
        rest = error - surface @ np.linalg.lstsq(surface, error)[0]
        fast = np.abs(rate) >= 5.0
        share = float(np.max(np.abs(rest[fast] / rate[fast])))
        left[profile] = (float(np.sqrt(np.mean(error**2) / np.mean(rest**2))), share)
    assert left["rd2100"][0] > 1000.0
    assert 7.0 < left["rd2100-paper"][0] < 15.0  # "about one order of magnitude"
    assert left["rd2100-paper"][1] < 0.02  # "less than 2 %" of a turn


def test_the_page_of_the_documentation_has_every_printed_number() -> None:
    page = (ROOT / "docs" / "explanation" / "papers.md").read_text(encoding="utf-8")
    rows = {tuple(cell.strip() for cell in line.split("|")[1:5]) for line in page.splitlines() if line.startswith("| ")}
    for paper in PAPERS.values():
        for each in paper.printed:
            value = "–" if each.value is None else f"{each.value:.4g}"
            assert (each.place, each.quantity, each.unit, f"{each.relation} {value}".strip()) in rows
        for contradiction in paper.contradictions:
            assert re.sub(r"\|", r"\\|", contradiction.statement) in page

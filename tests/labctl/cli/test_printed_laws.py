"""Laws on the terminal: each with its errors, what would follow from the first, and the command that takes it."""

from __future__ import annotations

import pytest

from labctl.answers.laws import ProposedLaw
from labctl.cli.printing.criticism import print_criticism
from labctl.services.criticism.laws import _sum
from tests.helpers.diagnoses import criticism


def law(probability: float, *formulas: str) -> ProposedLaw:
    return {
        "formulas": list(formulas), "kinds": [], "equations": {}, "coefficients": {}, "probability": probability,
        "log_bayes_factor": 40.0, "rms_after_dps": 0.0012, "heldout_rms_after_dps": 0.0017,
        "follows": ["It changes its sign with the direction of the rate, and is 0 at rest."],
    }  # fmt: skip


def test_laws_are_printed_with_their_errors_and_the_command_that_takes_the_first(
    capsys: pytest.CaptureFixture[str],
) -> None:
    laws = [law(0.75, "law_1: sin(9*rate_dps)", "law_2: abs(rate_dps)"), law(0.25, "law_1: rate_dps**3")]
    test = {"rate_dps": 96.0, "temperature_c": None, "difference_dps": 0.002, "do": "measure at 96 deg/s", "toml": ""}
    print_criticism(criticism("unexplained").model_copy(update={"laws": laws, "law_test": test}))
    lines = capsys.readouterr().out.splitlines()
    first = lines.index("75 %: law_1: sin(9*rate_dps); law_2: abs(rate_dps): 0.0012 deg/s, held-out 0.0017")
    assert lines[first + 1] == "25 %: law_1: rate_dps**3: 0.0012 deg/s, held-out 0.0017"
    assert lines[first + 2] == "to distinguish the first two: measure at 96 deg/s"
    assert lines[first + 3].endswith("It changes its sign with the direction of the rate, and is 0 at rest.")
    assert "labctl improve FOG-0001 --formula 'law_1: sin(9*rate_dps)' --formula 'law_2: abs(rate_dps)'" in lines[-1]


def test_a_single_law_is_to_be_tested(capsys: pytest.CaptureFixture[str]) -> None:
    test = {"rate_dps": 96.0, "temperature_c": None, "difference_dps": 0.002, "do": "measure at 96 deg/s", "toml": ""}
    laws = [law(1.0, "law_1: sin(9*rate_dps)")]
    print_criticism(criticism("unexplained").model_copy(update={"laws": laws, "law_test": test}))
    assert "to test it: measure at 96 deg/s" in capsys.readouterr().out.splitlines()


def test_a_sum_of_formulas_has_the_signs_of_its_coefficients() -> None:
    assert _sum([(0.02, "a"), (-0.03, "b"), (0.5, "c")]) == "0.02 * a - 0.03 * b + 0.5 * c"
    assert _sum([(-0.02, "a")]) == "-0.02 * a"

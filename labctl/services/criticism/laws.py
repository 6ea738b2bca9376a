"""Laws that are proposed for a residual without a name, as an answer: equation, figures, and what would follow."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from labctl.answers.laws import LawTest, ProposedLaw
from labctl.fitting.criticism import (
    Breaking,
    Criticism,
    Law,
    bends_over,
    breaking,
    coefficients_of_law,
    consequences,
    laws_of,
)
from labctl.progress import report_stage

#: The channels between whose levels a law is tested, in words.
LEVELS = {"table_rate_dps": "rates", "temperature_c": "temperatures"}


def proposed_laws(criticism: Criticism, recipe_for: Callable[[str], str]) -> tuple[list[ProposedLaw], LawTest | None]:
    """Return laws for what has no name, and where to measure next to test them; none beside a name.

    `recipe_for` makes the recipe, TOML, of the test: between the levels of the channel over which the likeliest bends.
    """
    if criticism.verdict.form != "unexplained":
        return [], None
    report_stage("searching a law")
    laws = laws_of(criticism)
    test = _test(breaking(laws, criticism), criticism)
    if test is not None:
        channel = bends_over(laws[0], criticism)
        if toml := recipe_for(channel):
            levels = f"between the {LEVELS[channel]} of the recordings, over which the likeliest law bends most"
            test["do"] += f"; the recipe of the test measures half-way {levels}"
            test["toml"] = toml
    return [_law(law, criticism) for law in laws], test


def _law(law: Law, criticism: Criticism) -> ProposedLaw:
    coefficients = coefficients_of_law(law)
    return {
        "formulas": list(law.formulas),
        "kinds": list(law.kinds),
        "equations": {
            axis: _sum([(of_axis[term.effect]["value"], term.formula) for term in law.terms])
            for axis, of_axis in coefficients.items()
        },
        "coefficients": coefficients,
        "probability": law.probability,
        "log_bayes_factor": law.evidence,
        "rms_after_dps": law.fit.error.rms_dps,
        "heldout_rms_after_dps": law.fit.error.heldout_rms_dps,
        "follows": consequences(law, criticism),
    }


def _sum(terms: Sequence[tuple[float, str]]) -> str:
    """Return a sum of formulas with their coefficients."""
    first, *others = (f"{'-' if value < 0 else '+'} {abs(value):.4g} * {formula}" for value, formula in terms)
    return " ".join([first.removeprefix("+ ").replace("- ", "-", 1), *others])


def _test(place: Breaking | None, criticism: Criticism) -> LawTest | None:
    if place is None:
        return None
    floor_dps = criticism.floor.rms_dps
    at = f"{place.rate_dps:.4g} deg/s" + (
        "" if place.temperature_c is None else f" and {place.temperature_c:.3g} deg C"
    )
    times = f", {place.difference_dps / floor_dps:.1f} times the noise floor" if floor_dps else ""
    what = "the two likeliest laws differ" if place.laws == 2 else "the law and the model without it differ"
    return {
        "rate_dps": place.rate_dps,
        "temperature_c": place.temperature_c,
        "difference_dps": place.difference_dps,
        "do": f"measure at {at}: there {what} most, by {place.difference_dps:.3g} deg/s{times}",
        "toml": "",
    }

"""Statements of conformity with limits around the truth: how often does a PASS hold, and how often is a FAIL wrong?

Every unit is simulated with numpy alone (`rate_vector_simulation`), calibrated, and verified at rates and temperatures
that the fit has not seen, on the same fixture. The limit is half to four times the largest true error of the corrected
rate over the ball of rate vectors and the range of temperatures, in a later session. `LABCTL_STUDY_UNITS` is how
many units, `LABCTL_STUDY_WORKERS` how many processes, `LABCTL_STUDY_SEED` the first seed.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from labctl.answers.certificates import DecisionRule, OrderedConformity
from labctl.certificates.document import AnyAxisResult
from labctl.fitting.data.fit_data import FitData, fit_data_of
from labctl.fitting.data.temperature.channel import with_temperature
from labctl.fitting.estimation.fit import fit_preset
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.models.presets import preset_for
from labctl.fitting.numeric.blas_threads import single_threaded
from labctl.fitting.uncertainty import (
    AxisEvidence,
    BenchConditions,
    RateVectorUncertainty,
    conditions_of,
    rate_vector_uncertainty,
    use_evidence,
)
from labctl.fitting.uncertainty.largest_error import widening
from labctl.fitting.uncertainty.vector_bound import PLACES, vector_bounds
from labctl.recording import Recording
from labctl.services.certificates.conformity import NoAcceptance, NoDecision, conformity
from labctl.services.certificates.evidence import Errors, VerifiedError
from studies.rate_vector_coverage import CASES, HIDDEN_DPS, MODEL, corrected, info_of
from studies.rate_vector_simulation import AXES, Bench, Noise, Plan, Statement, Unit, campaign, in_ball
from studies.report_tables import wilson

UNITS = int(os.environ.get("LABCTL_STUDY_UNITS", "1000"))
WORKERS = int(os.environ.get("LABCTL_STUDY_WORKERS", "2"))
FIRST_SEED = int(os.environ.get("LABCTL_STUDY_SEED", "90001"))
#: Rate vectors at which the true error is evaluated, of which every second is on the surface of the ball.
VECTORS = 4000
#: Rates and temperatures of a verification part, in each mounting.
RATES, TEMPERATURES = 6, 2
#: Limits over the largest true error, log-uniform.
LIMITS = (0.5, 4.0)
RULES: tuple[DecisionRule, ...] = ("simple", "guard-band")
TRIAXIAL = tuple(case for case in CASES if len(case.outputs) == len(AXES))


@dataclass(frozen=True)
class Outcome:
    """One decision."""

    case: int
    rule: DecisionRule
    decision: str  #: PASS, FAIL, "no acceptance" or "no decision"
    factor: float  #: of the guard band
    over: float  #: largest true error over the limit
    share_beyond: float  #: of the rate vectors whose error is beyond the limit


@dataclass(frozen=True)
class Calibrated:
    """A unit's calibration, and what is known for its uncertainty."""

    plan: Plan
    fitted: FittedModel
    evidence: Mapping[str, AxisEvidence]
    bench: BenchConditions
    seen_dps: float  #: the largest error of the data sets that were fitted
    seen: int

    @staticmethod
    def of(plan: Plan, recording: Recording) -> Calibrated:
        """Fit the model of the study to a recording."""
        data, preset = fit_data_of(recording), preset_for(None, list(MODEL))
        result = fit_preset(data, preset)
        bench = conditions_of(recording.info, result.environment, mountings=result.mountings)
        left = max(float(np.abs(values).max()) for values in result.residual_dps.values())
        return Calibrated(plan, result.fitted, use_evidence(data, preset), bench, left, len(data))

    def at(self, rates_dps: Mapping[str, float], temperature_c: float) -> RateVectorUncertainty:
        """Return the uncertainty at a rate vector."""
        return rate_vector_uncertainty(
            self.fitted, rates_dps, temperature_c, evidence=self.evidence, name="unit", bench=self.bench
        )

    def any_axis(self) -> tuple[AnyAxisResult, ...]:
        """Return the largest U of each output, as a certificate has it."""
        ends = (min(self.plan.temperatures_c), max(self.plan.temperatures_c))
        bounds = vector_bounds(
            self.fitted, self.plan.reach_dps, ends, evidence=self.evidence, name="unit", bench=self.bench
        )
        return tuple(
            AnyAxisResult(output=axis, reach_dps=self.plan.reach_dps, expanded_dps=bound["bound_dps"],
                          aligned_expanded_dps=bound["aligned_bound_dps"], why=bound.get("why") or "")
            for axis, bound in bounds.items()
        )  # fmt: skip

    def factor(self) -> float:
        """Return by how much U is widened for the largest of all errors."""
        places = [{a: self.plan.reach_dps * part for a, part in zip(AXES, place, strict=True)} for place in PLACES]
        ends = (min(self.plan.temperatures_c), max(self.plan.temperatures_c))
        return max(widening([self.at(place, warm) for place in places]) for warm in ends)

    def verified(self, unseen: FitData) -> Errors:
        """Return the errors of the corrected rates of data sets that the fit has not seen."""
        warm = unseen.temperature_c
        true = np.column_stack([unseen.true_rate_dps(axis) for axis in AXES])
        errors = corrected(self.fitted, np.column_stack([unseen.outputs[a] for a in AXES]), warm, AXES) - true
        found = []
        for row, rates in enumerate(true.tolist()):
            known = self.at(dict(zip(AXES, rates, strict=True)), float(warm[row]))
            found += [
                VerifiedError(axis, (rates[0], rates[1], rates[2]), float(warm[row]), float(errors[row, k]), budget)
                for k, (axis, budget) in enumerate(known.budgets.items())
            ]
        return Errors(self.seen_dps, self.seen, tuple(found), len(unseen), is_anew=True)


@single_threaded
def outcomes(number: int) -> list[Outcome]:
    """Return the decisions on one unit, by rule."""
    case = TRIAXIAL[number % len(TRIAXIAL)]
    rng, stated, noise, plan = np.random.default_rng([FIRST_SEED, number]), Statement(), Noise(), case.plan
    unit = Unit.of(rng, 0.0 if case.is_adequate else HIDDEN_DPS)
    bench = Bench.of(rng, stated, plan.mountings)
    low, high, reach = min(plan.temperatures_c), max(plan.temperatures_c), plan.reach_dps

    def measured(rates: tuple[float, ...], temperatures: tuple[float, ...]) -> Recording:
        at = replace(plan, rates_dps=rates, temperatures_c=temperatures)
        columns = campaign(unit, bench, at, noise, stated.turn_on_dps, rng, reach_dps=reach)
        return with_temperature(Recording(info_of(case, stated), columns))

    made = Calibrated.of(plan, measured(plan.rates_dps, plan.temperatures_c))
    drawn = rng.uniform(-reach, reach, RATES), rng.uniform(low, high, TEMPERATURES)
    errors = made.verified(fit_data_of(measured(tuple(drawn[0].tolist()), tuple(drawn[1].tolist()))))
    rates = in_ball(rng, VECTORS, reach)
    rates[::2] *= reach / np.linalg.norm(rates[::2], axis=1, keepdims=True)
    warm = rng.uniform(low, high, VECTORS)
    output = unit.output(rates, warm, reach) + rng.normal(0, stated.turn_on_dps, 3)
    true = np.abs(corrected(made.fitted, output, warm, AXES) - rates).max(axis=1)
    limit = float(true.max() * np.exp(rng.uniform(*np.log(LIMITS))))
    factor, any_axis = made.factor(), made.any_axis()
    over, beyond = float(true.max()) / limit, float(np.mean(true > limit))
    return [
        Outcome(number % len(TRIAXIAL), rule, _decision(rule, limit, errors, any_axis, factor), factor, over, beyond)
        for rule in RULES
    ]


def _decision(
    rule: DecisionRule, limit: float, errors: Errors, any_axis: tuple[AnyAxisResult, ...], factor: float
) -> str:
    try:
        ordered = OrderedConformity(specification="S", limit_dps=limit, rule=rule)
        return "PASS" if conformity(ordered, errors, (), any_axis, (), factor).passed else "FAIL"
    except NoAcceptance:
        return "no acceptance"
    except NoDecision:
        return "no decision"


def run(units: int = UNITS) -> str:
    """Return how often decisions are wrong, by rule."""
    with ProcessPoolExecutor(max_workers=WORKERS) as pool:
        every = [each for found in pool.map(outcomes, range(units), chunksize=4) for each in found]
    lines = []
    for rule in RULES:
        here = [each for each in every if each.rule == rule]
        counts = Counter(each.decision for each in here)
        passed = [each for each in here if each.decision == "PASS"]
        wrong = [each for each in passed if each.over > 1.0]
        good = [each for each in here if each.over <= 1.0]
        rejected = [each for each in good if each.decision != "PASS"]
        over = max((each.over for each in wrong), default=0.0)
        beyond = max((each.share_beyond for each in wrong), default=0.0)
        accepted = f"{_share(len(wrong), len(passed))} of PASS, {_share(len(wrong), len(here))} of all"
        factor = float(np.mean([each.factor for each in here]))
        lines += [
            f"{rule}: {dict(counts)} of {len(here)}; U widened by {factor:.2f} (mean)",
            f"  false acceptance {accepted}; true error over limit at most {over:.2f}, beyond it {100 * beyond:.2f} %",
            f"  false rejection {_share(len(rejected), len(good))} of those that conform",
        ]
    return "\n".join(lines)


def _share(hits: int, n: int) -> str:
    low, high = wilson(hits, n) if n else (0.0, 1.0)
    return f"{hits} of {n} ({100 * low:.1f} to {100 * high:.1f} %)"

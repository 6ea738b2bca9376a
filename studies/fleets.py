"""What a fleet knows: effects that no single unit shows, errors of benches, batches that differ, and priors.

Effects: units with an effect of z = 2 on one axis, of a shape that is not the catalogue's, beside fleets without any;
what the criticism would estimate of each unit is drawn by its own algebra for the schedule (z is the length of the
signal that the model does not absorb, in units of the noise), and one fleet of each kind goes through the whole
criticism. Benches, batches and priors: coefficients as a fit to the means of a campaign estimates them, with its
covariance; sizes are in spreads of the units.
`LABCTL_STUDY_FLEETS` is how many fleets each figure is of, `LABCTL_STUDY_SEED` the seed.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.criticism import candidate_estimates
from labctl.fitting.data.channels import BODY_AXES
from labctl.fitting.design.predicted_uncertainty import K, derivative_at_points, predicted_uncertainty
from labctl.fitting.estimation.axis_solutions import solve_axes
from labctl.fitting.estimation.prior import CoefficientPrior
from labctl.fitting.fleet.directions import kind_of_coefficient
from labctl.fitting.fleet.population import population_of
from labctl.fitting.fleet.prior import fit_with_prior, prior_of
from labctl.fitting.fleet.type_evidence import TypeCriticism, judged
from labctl.fitting.fleet.type_sums import TypeSums
from labctl.fitting.numeric.least_squares import solve
from studies.fleet_types import (
    ALIKE_BUT_BIAS,
    ALIKE_IN_TEMPERATURE,
    DIFFERENT,
    DRIFT,
    NOISE,
    PRESET,
    USE,
    Campaign,
    Fleet,
    drawn_noise,
    expected_drifts,
    truths,
)
from studies.fleet_units import HIDDEN, Algebra, criticised, recording
from studies.report_tables import wilson

FLEETS = int(os.environ.get("LABCTL_STUDY_FLEETS", "20"))
SEED = int(os.environ.get("LABCTL_STUDY_SEED", "36004"))
#: Units of a fleet, and the z of what is hidden; fleets without an effect, and without a group, for each with one.
UNITS, Z = 200, 2.0
WITHOUT_EFFECT, WITHOUT_GROUP = 25, 5
#: Units of the fleets that go through the whole criticism.
WHOLE_UNITS = 100
#: Units that priors are from, new units for each such fleet, and campaigns of a new unit: rates, temperatures.
PRIOR_UNITS, NEW_UNITS = (50, 10), 10
FULL, SMALL = (11, 5), (5, 3)
#: Fits for each fleet, of how the coverage of a fit alone depends on the drift.
UNITS_OF_DRIFTS = 30
SMALLER = tuple((rates, levels) for rates in (2, 3, 5, 7, 9, 11) for levels in (1, 2, 3, 4, 5))

Array = NDArray[np.float64]


def run(fleets: int = FLEETS, seed: int = SEED) -> str:
    """Return the tables."""
    return "\n".join(
        [
            *_effects(fleets, seed),
            "",
            *_whole(seed),
            "",
            *_groups(fleets, seed),
            "",
            *_priors(fleets, seed),
            "",
            *_drifts(UNITS_OF_DRIFTS * fleets, seed),
        ]
    )


def _effects(fleets: int, seed: int) -> Iterator[str]:
    """Yield how often a hidden effect is named for the type, by its own algebra."""
    algebra = Algebra.of(recording(seed))
    benches = [f"bench {i % 3}" for i in range(UNITS)]
    yield f"| {UNITS} units, z = {Z:g} in each | named for the type, % | another name, % | names in a group | by |"
    yield "| --- | --- | --- | --- | --- |"
    for row, (title, (shape, names)) in enumerate(HIDDEN.items()):
        signal, z = algebra.signal("x", shape)
        for signed in (False, True):
            found = []
            for i in range(fleets):
                rng = np.random.default_rng([seed, 1, row, int(signed), i])
                signs = rng.choice([-1.0, 1.0], UNITS) if signed else None
                found.append(judged(algebra.fleet(rng, benches, {"x": signal * Z / z}, signs)))
            right = sum(bool(each.named) and bool(names & set(each.named[0].group)) for each in found)
            wrong = sum(any(not names & set(effect.group) for effect in each.named) for each in found)
            size = np.mean([len(each.named[0].group) for each in found if each.named] or [0])
            alike = "sign of each unit" if signed else "the same in all"
            yield f"| {title}, {alike} | {share(right, fleets)} | {share(wrong, fleets)} | {size:.1f} | algebra |"
    quiet = fleets * WITHOUT_EFFECT
    false = 0
    for i in range(quiet):
        false += bool(judged(algebra.fleet(np.random.default_rng([seed, 2, i]), benches)).named)
    yield f"| nothing hidden | | {share(false, quiet)} | | algebra |"


def _whole(seed: int) -> Iterator[str]:
    """Yield what the whole criticism of every unit of two fleets says, by unit and by type."""
    title, (shape, names) = next(iter(HIDDEN.items()))
    algebra = Algebra.of(recording(seed))
    size = Z / algebra.signal("x", shape)[1]
    yield f"| whole criticism of {WHOLE_UNITS} units | named by units alone | named for the type | log evidence |"
    yield "| --- | --- | --- | --- |"
    for hidden, text in ((None, "nothing hidden"), ({"x": (shape, size)}, title)):
        sums, alone = TypeSums(), 0
        for unit in range(WHOLE_UNITS):
            found = criticised(recording(seed + 1 + unit, hidden))
            alone += bool(names & set(found.verdict.named)) if hidden else bool(found.verdict.named)
            sums.add(candidate_estimates(found), f"bench {unit % 3}")
        of_type = judged(sums)
        strongest = of_type.candidates[0].log_bayes_factor
        yield f"| {text} | {alone} of {WHOLE_UNITS} | {_named(of_type)} | {strongest:.1f} |"


def _named(found: TypeCriticism) -> str:
    return "; ".join(" or ".join(effect.group) for effect in found.named) or "nothing"


def _groups(fleets: int, seed: int) -> Iterator[str]:
    """Yield how often a bench, a batch, or nothing is named."""
    campaign = Campaign.of(*FULL)
    spread = DIFFERENT["scale_factor"][1]
    cases: Mapping[str, tuple[Fleet, tuple[str, str] | None]] = {
        "bench 2 of 3: rate off by one spread": (Fleet(DIFFERENT, UNITS, spread), ("bench", "bench 2")),
        "bench 2 of 3: rate off by half a spread": (Fleet(DIFFERENT, UNITS, spread / 2), ("bench", "bench 2")),
        "batch 7 of 20: bias of x off by two spreads": (
            Fleet(DIFFERENT, UNITS, 0.0, {"x.bias": 2 * DIFFERENT["bias"][1]}), ("batch", "B07"),
        ),
        "batch 7 of 20: bias of x off by three spreads": (
            Fleet(DIFFERENT, UNITS, 0.0, {"x.bias": 3 * DIFFERENT["bias"][1]}), ("batch", "B07"),
        ),
        "no group differs": (Fleet(DIFFERENT, UNITS), None),
    }  # fmt: skip
    yield f"| {UNITS} units | named, % | another group named, % | outliers, per fleet |"
    yield "| --- | --- | --- | --- |"
    for row, (title, (fleet, truth)) in enumerate(cases.items()):
        n = fleets if truth else fleets * WITHOUT_GROUP
        found = [population_of(fleet.drawn(campaign, np.random.default_rng([seed, 3, row, i]))) for i in range(n)]
        right = sum(any((e.factor, e.level) == truth for e in each.effects) for each in found)
        wrong = sum(any((e.factor, e.level) != truth for e in each.effects) for each in found)
        outliers = np.mean([len(each.outliers) for each in found])
        yield f"| {title} | {share(right, n) if truth else ''} | {share(wrong, n)} | {outliers:.2f} |"


def _priors(fleets: int, seed: int) -> Iterator[str]:
    """Yield how many data sets a new unit needs with a prior, for the U of a campaign without one."""
    yield (
        "| units of the type are | prior from | data sets alone | U, mdeg/s | data sets with it | ratio | U, mdeg/s "
        "| drift | covered alone, % | covered with it, % | covered by the exact prior, % | prior refused, % |"
    )
    yield "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |"
    kinds = {
        "alike in all but the bias": ALIKE_BUT_BIAS, "alike in temperature": ALIKE_IN_TEMPERATURE,
        "different in all": DIFFERENT,
    }  # fmt: skip
    for units, (row, ((title, kind), size)) in product(PRIOR_UNITS, enumerate(product(kinds.items(), (FULL, SMALL)))):
        full = Campaign.of(*size)
        alone = predicted_uncertainty(full.sets, BODY_AXES, PRESET, NOISE, USE).rms_dps
        populations = [
            population_of(Fleet(kind, units).drawn(full, np.random.default_rng([seed, 4, row, i])))
            for i in range(fleets)
        ]
        priors = [prior_of(each) for each in populations]
        exact = [exact_prior(kind, full.names, units)] * fleets
        campaign, u = smallest(priors[0], alone, full)
        n, few = len(full.sets), len(campaign.sets)
        for drift, is_drawn in (("of this study", False), ("drawn as a fit expects it", True)):
            inside_alone, _, _ = covered([None] * fleets, kind, full, seed, is_drawn)
            inside, places, refused = covered(priors, kind, campaign, seed, is_drawn)
            inside_exact, _, _ = covered(exact, kind, campaign, seed, is_drawn)
            yield (
                f"| {title} | {units} units | {n} | {1e3 * alone:.3g} | {few} | {few / n:.2f} | {1e3 * u:.3g} "
                f"| {drift} | {share(inside_alone, places)} | {share(inside, places)} | {share(inside_exact, places)} "
                f"| {share(refused, fleets * NEW_UNITS)} |"
            )


def _drifts(units: int, seed: int) -> Iterator[str]:
    """Yield how the coverage of a fit without a prior depends on what is known of the drift, and on what it is.

    A fit does not know the drift: it is averaged over sizes and time constants. Where they are drawn as it expects them
    the coverage is that of U; for one drift alone it may be more, or less.
    """
    yield "| data sets | noise of the fit | covered, % | rms of error over u | u over that with the noise known |"
    yield "| --- | --- | --- | --- | --- |"
    for row, size in enumerate((FULL, SMALL)):
        campaign, rng = Campaign.of(*size), np.random.default_rng([seed, 6, row])
        scatter, design = campaign.data.scatter("x"), campaign.designs["x"]
        jacobian = derivative_at_points(campaign.model, USE, design, "x")
        expected = expected_drifts(rng, scatter, units)
        for title, drifts, is_known in (
            ("known", [DRIFT] * units, True), ("of this study", [DRIFT] * units, False),
            ("drawn as a fit expects it", expected, False),
        ):  # fmt: skip
            ratio, longer = np.zeros(units), np.zeros(units)
            for i, drift in enumerate(drifts):
                y = drawn_noise(rng, campaign.sets.middle_s, scatter, drift)
                place = jacobian[rng.integers(len(jacobian))]
                known = solve(design.columns, y, scatter, drift)
                fit = known if is_known else solve(design.columns, y, scatter)
                u, u_known = (float(np.sqrt(place @ each.covariance @ place)) for each in (fit, known))
                ratio[i], longer[i] = float(place @ fit.values) / u, u / u_known
            inside = int((np.abs(ratio) <= K).sum())
            yield (
                f"| {len(campaign.sets)} | {title} | {share(inside, units)} | {np.sqrt(np.mean(ratio**2)):.2f} "
                f"| {np.median(longer):.2f} |"
            )


def smallest(prior: CoefficientPrior, u_dps: float, full: Campaign) -> tuple[Campaign, float]:
    """Return the campaign of the fewest data sets that reaches U by a prior, and its U, deg/s."""
    for rates, levels in sorted(SMALLER, key=lambda each: (each[0] * each[1], each[1])):
        campaign = Campaign.of(rates, levels)
        reached = predicted_uncertainty(campaign.sets, BODY_AXES, PRESET, NOISE, USE, prior).rms_dps
        if reached <= u_dps * 1.0001:
            return campaign, reached
    return full, u_dps


def exact_prior(kind: Mapping[str, tuple[float, float]], names: Sequence[str], units: int) -> CoefficientPrior:
    """Return the prior of a type whose mean and spread are known exactly."""
    mean, spread = np.array([kind[kind_of_coefficient(name)] for name in names]).T
    return CoefficientPrior(tuple(names), mean, np.diag(spread**2), units, 25.0)


def covered(
    priors: Sequence[CoefficientPrior | None],
    kind: Mapping[str, tuple[float, float]],
    campaign: Campaign,
    seed: int,
    is_drift_drawn: bool,
) -> tuple[int, int, int]:
    """Return how many corrected rates of new units are within their U, of how many, and how many priors were refused.

    One place of the range of use is drawn for each axis of each unit.
    """
    inside = places = refused = 0
    for i, prior in enumerate(priors):
        rng = np.random.default_rng([seed, 5, i])
        for truth in truths(rng, kind, campaign.names, NEW_UNITS):
            data = campaign.measured(rng, truth, is_drift_drawn=is_drift_drawn)
            if prior is not None:
                found = fit_with_prior(data, PRESET, prior)
                fits, refused = found.fitted.axes, refused + (not found.is_used)
            else:
                fits = solve_axes(data, campaign.model).fits
            begin = 0
            for axis, design in campaign.designs.items():
                jacobian = derivative_at_points(campaign.model, USE, design, axis)
                place = jacobian[rng.integers(len(jacobian))]
                fit = fits[axis]
                own = truth[begin : begin + len(place)]
                begin += len(place)
                off = float(place @ (fit.values.ravel() - own))
                inside += abs(off) <= K * float(np.sqrt(place @ fit.covariance @ place))
                places += 1
    return inside, places, refused


def share(count: int, n: int) -> str:
    """Return a share in percent with its 95 % interval."""
    low, high = wilson(count, n)
    return f"{100 * count / n:.1f} ({100 * low:.1f} to {100 * high:.1f}, n = {n})"

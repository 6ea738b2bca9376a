"""The figures of a fit beside those of another fit: coefficients, u, errors at temperatures left out, noise.

Each row is a kind of figure, as in `studies.page_figures_pages`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from studies.page_figures_evidence import log_bayes_factor
from studies.page_figures_lack import AxisNoise, Reduced, chance_above, lack_of_fit
from studies.page_figures_pages import SMALL_DIFFERENCE, Compared, Row, figure
from studies.page_figures_recomputed import environment_of, stability_of, turning_size_of
from studies.page_figures_refit import Refit
from studies.page_figures_surface import Course, drift_of_floor, near_repeats, surface

#: Of chi2: rates are stored to 1e-7 of the noise, and each of its terms is twice as much off.
OF_CHI2 = 1e-6
#: Evidence is by normal equations with 1e-10 of their diagonal added, which moves it by 2e-5 nats; else by 1e-8.
OF_NATS = 5e-5
#: Of the standard uncertainty of a coefficient: the outputs differ by the rounding of the stored table rates, which is
#: 1e-7 of the noise.
SHARE_OF_U = 1e-6
#: Data sets without times are numbered by the fit without a temperature as if they followed each other.
TIMES_CLOSED_UP = 1e-4
#: A drift is averaged by likelihoods. Rates of 400 deg/s are stored with 12 digits, to 2e-10 deg/s or 1e-7 of noise,
#: and so a sum of a hundred squares over the noise is the same to 2e-5.
OF_THE_LIKELIHOOD = 2e-5


def fit_of_version(c: Compared) -> Iterator[Row]:
    """Yield coefficients and u of a version, its error at temperatures left out, and the noise of the means."""
    answer, refit = c.get(c.path), c.refit
    for axis, (values, covariance) in refit.averaged.items():
        names = c.law.names[axis]
        u = np.sqrt(np.diag(covariance))[: len(names)]
        shown = [answer["axes"][axis]["coefficients"][name] for name in names]
        off = np.abs(np.array([each["value"] for each in shown]) - values[: len(names)]) / u
        yield Row("coefficients by a refit, of their u", float(off.max()), len(names), SHARE_OF_U)
        yield figure("u of coefficients by a refit, over another", [each["u"] for each in shown] / u, np.ones(len(u)),
                     SHARE_OF_U)  # fmt: skip
    yield from _left_out(c, refit)
    yield from _noise(c, refit)
    yield from _lack_of_fit(c)


def _left_out(c: Compared, refit: Refit) -> Iterator[Row]:
    """Yield the RMS error at temperatures left out, wherever it is shown; unknown where a fit cannot do without one."""
    answer = c.get(c.path)["error"]["heldout_rms_dps"]
    (step,) = (each for each in c.get(f"/api/units/{c.serial}/ladder")["steps"] if each["version"] == c.version)
    shown = [answer, c.get(f"{c.path}/criticism")["error"]["heldout_rms_dps"], step["heldout_rms_dps"]]
    own = refit.rms_left_out()
    if own is None:
        assert shown == [None] * 3, f"RMS error at temperatures left out: {shown}, and no fit can do without one"
        return
    yield figure("RMS error at temperatures left out", shown, [own] * 3, TIMES_CLOSED_UP)


def _noise(c: Compared, refit: Refit) -> Iterator[Row]:
    """Yield the white noise of a mean, the drift beside it and the noise floor of both, or that of near repeats."""
    criticism, noise = c.get(f"{c.path}/criticism"), c.get(c.path)["noise"]
    error, means = criticism["error"], {axis: replace(each, turning_var=0.0) for axis, each in refit.means.items()}
    if error["noise_floor_source"] == "repeats":
        flat = [(surface(c.sets, axis, None), each) for axis, each in refit.errors_dps.items()]
        own = near_repeats([each - columns @ (columns.T @ each) for columns, each in flat], c.sets)
        yield figure("noise floor by near repeats", [error["noise_floor_dps"]], [own], SMALL_DIFFERENCE)
        return
    white = {axis: each.white_var for axis, each in means.items() if each.white_var is not None}
    own_white = [np.sqrt(np.mean(each)) for each in white.values()]
    yield figure("white noise of a mean", [noise[axis]["white_dps"] for axis in white], own_white, SMALL_DIFFERENCE)
    logged = environment_of(c.database, c.recording)
    course = Course(logged["t_s"], logged["temperature_c"])
    drift = {axis: drift_of_floor(c.sets, axis, means[axis], course) for axis in white}
    yield figure("drift in the noise floor", [noise[axis]["drift_dps"] for axis in drift],
                 [each.size_dps for each in drift.values()], OF_THE_LIKELIHOOD)  # fmt: skip
    yield figure("noise in proportion to the rate", [noise[axis]["per_rate"] for axis in drift],
                 [each.per_rate for each in drift.values()], OF_THE_LIKELIHOOD)  # fmt: skip
    yield figure("longest time constant of the drift", [noise[axis]["drift_tau_s"] for axis in drift],
                 [max(each.taus_s) for each in drift.values()])  # fmt: skip
    largest, (stability, *_) = max(drift.values(), key=lambda each: each.size_dps), (
        each.stability_dps for each in means.values()
    )  # fmt: skip
    ratio = np.nan if stability is None or not np.isfinite(max(largest.taus_s)) else largest.size_dps / (stability / 2)
    yield figure("drift over that of the data sheet", [criticism["noise"]["vs_datasheet"]], [ratio], OF_THE_LIKELIHOOD)
    floors = [each + drift[axis].size_dps ** 2 + (drift[axis].per_rate * c.sets.table_rate_dps) ** 2
              for axis, each in white.items()]  # fmt: skip
    yield figure("noise floor", [error["noise_floor_dps"]], [np.sqrt(np.mean(floors))], OF_THE_LIKELIHOOD)


def _lack_of_fit(c: Compared) -> Iterator[Row]:
    """Yield the test of the lack of fit of readings beside a model that is adequate, so that no effect is taken off."""
    criticism = c.get(f"{c.path}/criticism")
    if criticism["verdict"] != "adequate" or not c.sets.raw:
        return
    assert not criticism["readings_left_out"], "outliers are not written here"
    stability = stability_of(c.database, c.recording)
    assert stability is not None
    reduced = Reduced(c.sets, c.law, turning_size_of(c.database, c.recording))
    axes = [AxisNoise.of(reduced, axis, stability) for axis in c.law.axes]
    chi2, freedom = lack_of_fit(axes)
    shown = criticism["lack_of_fit"]
    yield figure("residual variance over that of noise and drift", [shown["statistic"]], [chi2 / freedom], OF_CHI2)
    yield figure("chance that noise leaves as much", [shown["p_value"]], [chance_above(chi2, freedom)], OF_CHI2)
    found = {each["effect"]: (each, log_bayes_factor(each["effect"], axes)) for each in criticism["suspects"]}
    known = {effect: (each, own) for effect, (each, own) in found.items() if own is not None}
    nats = [own for _, own in known.values()]
    yield figure("evidence for an effect", [each["log_bayes_factor"] for each, _ in known.values()], nats, OF_NATS)
    odds = np.array([each["probability"] for each, _ in known.values()])
    yield figure("odds between two effects", odds / odds[0], np.exp(np.array(nats) - nats[0]), OF_NATS)

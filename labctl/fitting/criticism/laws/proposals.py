"""Laws that are proposed for a residual: fitted with the model, held to data that were left out, and put into words.

A law is a description and no cause: it says what the error follows, not why. It is proposed where no effect of the
catalogue explains a residual, and only where the data that a fit has not seen are predicted better with it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from labctl.answers.fitted_model import Coefficient
from labctl.errors import BadInput, LabctlError
from labctl.fitting.criticism.criticism import Criticism
from labctl.fitting.criticism.laws.search import Search, State
from labctl.fitting.criticism.laws.shapes import TABLE_RATE, TEMPERATURE, library, scales_of
from labctl.fitting.criticism.model_comparison import Comparison
from labctl.fitting.criticism.search.held_out import held_out_rises
from labctl.fitting.data.channels import Channels
from labctl.fitting.data.temperature.levels import ONE_LEVEL_SPAN_C
from labctl.fitting.effects import Term
from labctl.fitting.effects.formula import Formula
from labctl.fitting.estimation.fit import fit_preset
from labctl.fitting.estimation.result import FitResult
from labctl.fitting.models.presets import changed
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.blas_threads import single_threaded
from labctl.fitting.numeric.json_numbers import none_for_nan
from labctl.progress import report_stage
from labctl.recording.columns import RECORDING

#: Laws at most that are proposed, and states of the search that are looked through for them.
MAX_LAWS, MAX_TRIED = 5, 16
#: The time since the start of the first recording, s.
TIME = "t_s"
#: Channels besides the rate that a law may depend on, the first of those that the residual follows.
MAX_CHANNELS = 2
#: Two laws are one where what they take off the data sets is so alike.
ALIKE = 0.9995
#: A law is not proposed that has this much less evidence than the best, nats: a hundredth of its probability.
FAR_BEHIND = 4.6
#: Two channels moved together where the correlation of their ranks is beyond this.
MOVED_TOGETHER = 0.9
#: Between the rates of the data sets a law adds no more than this many times what it adds at them.
ASTRAY = 1.5
#: More formulas than this no model has.
MAX_NAMES = 40
#: Shares of the rates of the data sets at which laws are compared: between them and, where the unit can, beyond.
BETWEEN = tuple(float(share) for share in np.linspace(0.1, 1.25, 24))


@dataclass(frozen=True)
class Law:
    """A description of a residual: formulas, each times a coefficient of its own, and what comes of them."""

    terms: tuple[Term, ...]  #: as a model has them
    kinds: tuple[str, ...]  #: what each is, in words
    evidence: float  #: log Bayes factor against the model, less the price of its length, nats
    probability: float  #: among the laws that are proposed
    fit: FitResult  #: the model with it
    taken_dps: dict[str, Array]  #: axis -> (m,) what the fit with it takes off the residual of each data set

    @property
    def formulas(self) -> tuple[str, ...]:
        """Its formulas as `improve --formula` takes them: `name: expression`."""
        return tuple(f"{term.effect}: {term.formula}" for term in self.terms)


@dataclass(frozen=True)
class Breaking:
    """Where the errors of two laws differ most, which describe the data sets alike: a measurement there refutes one.

    Of a single law, where it and the model without it differ most.
    """

    rate_dps: float
    temperature_c: float | None
    difference_dps: float  #: between the two
    laws: int  #: 2, or 1 where the other is the model without a law


@single_threaded
def laws_of(criticism: Criticism) -> list[Law]:
    """Return the laws that are proposed for what a model leaves, at most five, the likeliest first.

    They are functions of the rate and of the channels that the residual follows. None of them makes the error at
    temperatures or rates that were left out worse.
    """
    comparison, base = criticism.beside_missing, criticism.base
    if comparison is None or base is None:
        return []
    scales = scales_of(criticism.data, _channels(criticism))
    if not scales:
        return []
    states = Search(comparison, library(scales)).run()
    report_stage("holding laws to data that were left out")
    laws: list[Law] = []
    for state in states[:MAX_TRIED]:
        if len(laws) == MAX_LAWS or (laws and state.score < laws[0].evidence - FAR_BEHIND):
            break
        law = _fitted(criticism, comparison, base, state)
        if law is not None and not any(_are_alike(law, other) for other in laws):
            laws.append(law)
    total = np.logaddexp.reduce([law.evidence for law in laws]) if laws else 0.0
    return [replace(law, probability=float(np.exp(law.evidence - total))) for law in laws]


def coefficients_of_law(law: Law) -> dict[str, dict[str, Coefficient]]:
    """Return axis -> term -> value, standard uncertainty and unit of its coefficient in the fit with it."""
    coefficients: dict[str, dict[str, Coefficient]] = {}
    for axis, fit in law.fit.fitted.axes.items():
        u = none_for_nan(fit.u)
        rows = {owner: k for k, owner in enumerate(fit.effects)}
        coefficients[axis] = {
            term.effect: {"value": float(fit.values[row, 0]), "u": u[row][0], "unit": "deg/s"}
            for term in law.terms
            if (row := rows.get(term.effect)) is not None
        }
    return coefficients


def breaking(laws: Sequence[Law], criticism: Criticism) -> Breaking | None:
    """Return where the two likeliest laws differ most, with all else of their fits; None without a law.

    A single law is compared with the model without it.

    The rates are those of the data sets, of their axes alone, times a share of up to a quarter more, as far as the unit
    goes; the other channels are those of the data sets.
    """
    if not laws or criticism.base is None:
        return None
    fits = (*(law.fit for law in laws[:2]), criticism.base)[:2]
    data, most = criticism.fit_data, Breaking(0.0, None, 0.0, min(len(laws), 2))
    limit_dps = data.info.max_rate_dps or np.inf
    for axis in data.outputs:
        rate_dps = data.true_rate_dps(axis)
        for share in BETWEEN:
            channels = at_rates(data.channels, axis, share)
            first, second = (where_finite(partial(fit.fitted.error_dps, channels, axis)) for fit in fits)
            if first is None or second is None:
                continue
            apart = np.where(np.abs(share * rate_dps) <= limit_dps, np.abs(first - second), 0.0)
            row = int(np.argmax(apart))
            if float(apart[row]) > most.difference_dps:
                temperature_c = float(data.temperature_c[row]) if data.channels.history.thermometer else None
                most = replace(
                    most, rate_dps=share * float(rate_dps[row]), temperature_c=temperature_c,
                    difference_dps=float(apart[row]),
                )  # fmt: skip
    return most if most.difference_dps > 0 else None


def _channels(criticism: Criticism) -> list[str]:
    """Return the rate, and the first channels that the residual follows; the temperature where it follows none.

    A temperature that was held is left out, and so is a channel that moved with the temperature: the schedule does not
    say which of the two it is. In several recordings the time is a date: a law of it says nothing of another day.
    """
    dates = {TIME} if RECORDING in criticism.fit_data.channels else set[str]()
    follows = [
        name
        for name in criticism.verdict.depends_on
        if name not in {TABLE_RATE, *dates} and not _moved_with_temperature(criticism, name)
    ]
    if np.ptp(criticism.fit_data.temperature_c) <= ONE_LEVEL_SPAN_C:
        follows = [name for name in follows if name != TEMPERATURE]
    elif TEMPERATURE not in follows[:MAX_CHANNELS]:
        follows = [*follows[: MAX_CHANNELS - 1], TEMPERATURE]
    return [TABLE_RATE, *follows[:MAX_CHANNELS]]


def _moved_with_temperature(criticism: Criticism, name: str) -> bool:
    """Return whether a channel rose and fell with the temperature, or against it, over the data sets."""
    data = criticism.fit_data
    if name == TEMPERATURE or name not in data.channels or not data.channels.history.thermometer:
        return False
    values = np.asarray(data.channels[name], dtype=np.float64)
    ranks = np.argsort(np.argsort(np.stack([values, data.temperature_c]), axis=1), axis=1)
    one, other = ranks - ranks.mean(axis=1, keepdims=True)
    return bool(abs(one @ other) > MOVED_TOGETHER * np.linalg.norm(one) * np.linalg.norm(other))


def added_dps(fit: FitResult, base: FitResult, channels: Channels, axis: str) -> Array:
    """Return what a fit with a law expects beyond the fit of the model alone, (n,) deg/s of one output.

    The part of the law that coefficients of the model can describe counts as theirs.
    """
    return fit.fitted.error_dps(channels, axis) - base.fitted.error_dps(channels, axis)


def where_finite(expected: Callable[[], Array]) -> Array | None:
    """Return what a law expects; None where a formula of it has no finite value, as far beyond the data."""
    try:
        return expected()
    except BadInput:
        return None


def at_rates(channels: Channels, axis: str, share: float) -> Channels:
    """Return channels with a share of the rates about one axis."""
    return channels.with_rates({**channels.rates, axis: share * channels.rate_dps(axis)})


def _goes_astray(criticism: Criticism, base: FitResult, fit: FitResult) -> bool:
    """Return whether a fit adds far more between the rates of the data sets, where nothing was measured."""
    channels = criticism.fit_data.channels
    for axis in criticism.fit_data.outputs:
        most = ASTRAY * float(np.abs(added_dps(fit, base, channels, axis)).max(initial=0.0))
        for share in (share for share in BETWEEN if share <= 1.0):
            between = where_finite(partial(added_dps, fit, base, at_rates(channels, axis, share), axis))
            if between is None or float(np.abs(between).max(initial=0.0)) > most:
                return True
    return False


def _fitted(criticism: Criticism, comparison: Comparison, base: FitResult, state: State) -> Law | None:
    """Return a law as it is fitted beside a model; None where what was left out is not predicted better with it."""
    names = [name for name in (f"law_{k}" for k in range(1, MAX_NAMES)) if name not in comparison.model.effect_ids]
    terms = tuple(Term(name, formula=text) for name, text in zip(names, state.formulas, strict=False))
    if held_out_rises(comparison, terms, {term.effect: Formula(term.effect, term.formula) for term in terms}):
        return None
    try:
        fit = fit_preset(criticism.fit_data, changed(base.fitted.model, terms))
    except LabctlError:  # what is exported could not be inverted, or the means do not determine it
        return None
    if _is_worse(base, fit) or _goes_astray(criticism, base, fit):
        return None
    kinds = tuple(part.shape.kind for part in state.parts)
    taken = {axis: values - fit.residual_dps[axis] for axis, values in base.residual_dps.items()}
    return Law(terms, kinds, state.score, 0.0, fit, taken)


def _is_worse(before: FitResult, after: FitResult) -> bool:
    """Return whether a fit leaves more than the one before it, of all data sets or of those left out."""
    pairs = [
        (before.error.rms_dps, after.error.rms_dps),
        (before.error.heldout_rms_dps, after.error.heldout_rms_dps),
    ]
    return any(old is not None and (new is None or new >= old) for old, new in pairs)


def _are_alike(one: Law, other: Law) -> bool:
    """Return whether two laws take the same off the data sets."""
    a, b = (np.concatenate(list(law.taken_dps.values())) for law in (one, other))
    size = float(np.linalg.norm(a) * np.linalg.norm(b))
    return size > 0 and float(a @ b) / size > ALIKE

"""Laws that are proposed for a residual which no effect of the catalogue explains."""

from __future__ import annotations

from typing_extensions import TypedDict

from labctl.answers.fitted_model import Coefficient


class ProposedLaw(TypedDict):
    """A formula that describes a residual which no effect of the catalogue explains: a description, and no cause."""

    formulas: list[str]
    """Its terms as `labctl improve --formula` takes them, 'name: expression'; each has a coefficient of its own."""
    kinds: list[str]
    """What each part of it is, in words."""
    equations: dict[str, str]
    """Output axis -> error in deg/s, with the coefficients of the axis."""
    coefficients: dict[str, dict[str, Coefficient]]
    """Output axis -> name of the term -> its coefficient in a fit of the model with the law."""
    probability: float
    """Probability among the laws that are proposed, 0 to 1."""
    log_bayes_factor: float
    """Natural logarithm of the Bayes factor of the model with the law against the model, less the price of its length
    and of the laws that were tried."""
    rms_after_dps: float | None
    """RMS residual of a fit of the model with the law, deg/s."""
    heldout_rms_after_dps: float | None
    """RMS error of that fit on data sets left out in turn, deg/s; null: none can be left out."""
    follows: list[str]
    """What else would follow from it, a sentence each."""


class LawTest(TypedDict):
    """Where the two likeliest laws differ most, or a single law and the model without it: what refutes one of them."""

    rate_dps: float
    """Rate, deg/s."""
    temperature_c: float | None
    """Temperature, deg C; null: the recording has no thermometer."""
    difference_dps: float
    """Difference of the errors that the two fits expect there, deg/s."""
    do: str
    """What to measure, in words."""
    toml: str
    """Recipe that measures half-way between the rates of the recordings, or between their temperatures where the
    likeliest law bends over these, TOML; empty where the bench has none."""

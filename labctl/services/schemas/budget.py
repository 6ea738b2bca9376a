"""Uncertainty budgets: lines, what they combine to, and the lines of a picture."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from labctl.services.schemas.base import ResponseModel


class BudgetLineResponse(ResponseModel):
    """One source of uncertainty; null is unknown, never 0."""

    source: str = Field(description="coefficients, model, repeatability, or the quantity of a reference standard.")
    name: str = Field(description="Of the standard, with the number of its certificate.")
    type: Literal["A", "B"] = Field(description="Evaluated by statistics (A) or otherwise (B).")
    distribution: str
    u: float | None = Field(description="Standard uncertainty of the input, in `unit`; null: not stated or unknown.")
    unit: str
    sensitivity: float | None = Field(description="Derivative of the result along the input, per `unit`.")
    contribution: float | None = Field(description="Size of sensitivity times u, in the unit of the result.")
    degrees_of_freedom: float | None = Field(description="null: infinite.")
    uncorrected: float = Field(description="Known error that nothing corrects for, in the unit of the result.")
    common_to_all_rates: bool = Field(
        description="Whether the error is the same at all rates, so that it adds linearly and no mean reduces it."
    )
    stated: bool = Field(description="Whether the bench states this standard; if not, it is not in the result.")
    overdue: bool = Field(description="Whether the standard was past its due date when it was used.")
    due: str | None
    why: str = Field(description="Why a number is null or 0, or how it was evaluated.")


class BudgetResponse(ResponseModel):
    """A result with its lines (GUM)."""

    result: str = Field(description="corrected_rate, bias, scale_factor, or misalignment with an axis.")
    unit: str = Field(description="Of the result and of every contribution; 1 is a share of the rate.")
    value: float | None = Field(description="Of a coefficient.")
    lines: list[BudgetLineResponse]
    combined: float | None = Field(description="Combined standard uncertainty; null: a line of type A is unknown.")
    effective_degrees_of_freedom: float | None = Field(description="Welch-Satterthwaite; null: infinite.")
    k: float | None = Field(description="Coverage factor for a probability of 95.45 %.")
    expanded: float | None = Field(description="k times combined, plus the size of known errors left uncorrected.")
    not_stated: list[str] = Field(description="Standards that are not stated and therefore not in the result.")
    overdue: bool = Field(description="Whether a standard was past its due date when it was used.")


class ContributionLines(ResponseModel):
    """Contributions along one variable, deg/s."""

    at: list[float]
    contributions: dict[str, list[float | None]] = Field(description="Source -> contribution; null: not stated.")
    combined: list[float | None]
    expanded: list[float | None]


class ContributionsOver(ResponseModel):
    """Contributions to the uncertainty of one axis, over rate and over temperature."""

    temperature_c: float = Field(description="Temperature of the lines over rate, deg C.")
    rate_dps: float = Field(description="Rate of the lines over temperature, deg/s.")
    over_rate: ContributionLines
    over_temperature: ContributionLines

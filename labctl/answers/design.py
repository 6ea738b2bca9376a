"""Design of a campaign: what is asked for, and the recipe that reaches it."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from labctl.answers.base import Request, ResponseModel, SeveralLines
from labctl.answers.common_fields import BenchName
from labctl.answers.plans import RecipeSource

#: Two numbers, the lower first.
Range = tuple[float, float]
MAX_PRIOR, MAX_EFFECTS = 20, 50
Effect = Annotated[str, Field(min_length=1, max_length=200)]


class DesignRequest(Request):
    """What a campaign has to reach, for which model and over which range."""

    like: Annotated[RecipeSource | None, SeveralLines()] = Field(
        default=None,
        description="Recipe whose rates, temperatures, positions and model count where the request gives none; "
        "null: the ranges are those of the bench and its units.",
    )
    model: str | None = Field(
        default=None, max_length=100, description="Model to fit; null: that of `like`, else bias_scale."
    )
    effects: list[Effect] = Field(
        default_factory=list, max_length=MAX_EFFECTS, description="Effects to fit beside the model."
    )
    u_dps: float | None = Field(
        default=None,
        gt=0,
        description="U (k = 2) that each component of a corrected rate vector has to reach everywhere in the range, "
        "deg/s; null: as small as the hours allow.",
    )
    hours: float | None = Field(default=None, gt=0, description="Bench hours at most, h; null: no limit.")
    rates_dps: Range | None = Field(
        default=None, description="Lowest and highest rate, deg/s; null: those of `like`, or of the bench."
    )
    temperatures_c: Range | None = Field(
        default=None, description="Lowest and highest temperature, deg C; null: those of `like`, or of the bench."
    )
    prior: list[Annotated[str, Field(max_length=200)]] = Field(
        default_factory=list, max_length=MAX_PRIOR,
        description="Serial numbers whose newest calibrations state the noise: of this unit, or of its type.",
    )  # fmt: skip

    type_prior: str | None = Field(
        default=None, min_length=1, max_length=200,
        description="Type of units whose calibrations by the same model say what is expected of the coefficients: the "
        "design counts with it, and the recipe is fitted with it. Null: without.",
    )  # fmt: skip

    @model_validator(mode="after")
    def _asks_for_something(self) -> DesignRequest:
        if self.u_dps is None and self.hours is None:
            raise ValueError("neither u_dps (deg/s) nor hours (h) is given; give one of the two, or both")
        if self.like is None and self.model is None and not self.effects:
            raise ValueError("neither a recipe (like) nor a model is given; give one of the two")
        for name, limits in (("rates_dps", self.rates_dps), ("temperatures_c", self.temperatures_c)):
            if limits is not None and not limits[0] < limits[1]:
                raise ValueError(f"{name}: {limits[0]:g} is not below {limits[1]:g}; give the lower value first")
        return self


class DesignedCampaign(ResponseModel):
    """One recipe on the bench: what it costs, and what it is expected to give."""

    text: str = Field(description="What the recipe does, in words.")
    hours: float = Field(description="Expected duration by the plan on the bench, h.")
    hours_per_unit: float = Field(description="The same over the units that are measured at once, h.")
    u_worst_dps: float = Field(
        description="Largest U (k = 2) of a component of the corrected rate vector in the range, deg/s, by what the "
        "campaign decides: noise, drift and unsettled heat."
    )
    u_rms_dps: float = Field(description="Root mean square of the same U over the range, deg/s.")
    u_heat_dps: float = Field(description="Part of unsettled heat in `u_rms_dps`, deg/s.")
    worst_axis: str = Field(description="Output where U is largest.")
    worst_temperature_c: float = Field(description="Temperature where U is largest, deg C.")
    datasets: int = Field(description="Number of data sets.")
    coefficients: int = Field(description="Number of coefficients that are estimated, of all outputs.")
    mountings: int = Field(description="Number of mountings.")
    covered_c: Range = Field(description="Lowest and highest temperature expected of the unit in a data set, deg C.")
    is_reaching: bool = Field(description="Whether it reaches the goal: U everywhere in the range, and the hours.")


class DesignPrior(ResponseModel):
    """What a design counts with of the type of a unit, and what it saves."""

    type: str = Field(description="Type of the units: the model that their manufacturer gives them.")
    model: str = Field(description="Error model of their calibrations.")
    units: int = Field(description="Number of units that the prior is from.")
    without: DesignedCampaign | None = Field(
        description="The recipe that would be chosen for the same goal without the prior; null: none was found."
    )


class DesignBound(ResponseModel):
    """The least hours in which any recipe could reach the same U: by noise and by heat."""

    noise_h: float = Field(
        description="Without a break at the best points of the range, with white noise alone, until the root mean "
        "square of U is that of the goal (or of the chosen recipe, without a goal), h."
    )
    heat_h: float = Field(
        description="Ramps of the chamber through the range in each mounting, as fast as it can, and person, h."
    )
    bound_h: float = Field(description="The larger of the two, h.")
    ratio: float = Field(description="Hours of the chosen recipe over `bound_h`.")


class TiltedDesign(ResponseModel):
    """What a tilted fixture is worth, which brings a direction of the units between their axes up."""

    position: str = Field(description="The direction that points up, such as x+y+z.")
    is_on_bench: bool = Field(
        description="Whether the bench file states such a fixture; false: these are the hours of a bench that has one."
    )
    best: DesignedCampaign = Field(description="The best recipe with it: the temperature moves in this mounting alone.")
    recipe_toml: str = Field(description="That recipe as a recipe file, TOML.")
    without: DesignedCampaign | None = Field(description="The best recipe without it; null: there is none.")
    bound: DesignBound | None = Field(description="The least hours with it; null: the model has no law over the range.")


class DesignResponse(ResponseModel):
    """The recipe that was chosen, why, and what it was compared with."""

    bench: BenchName
    model: str | None = Field(description="Model that is fitted; null: effects alone.")
    effects: list[str] = Field(description="Effects that are fitted beside it.")
    rates_dps: Range = Field(description="Range of the size of the rate vector in use, both ways, deg/s.")
    temperatures_c: Range = Field(description="Range of temperatures in use, deg C.")
    is_reached: bool = Field(description="Whether the chosen recipe reaches the goal.")
    chosen: DesignedCampaign = Field(description="The chosen recipe.")
    recipe_toml: str = Field(description="The chosen recipe as a recipe file, TOML.")
    schedule_hash: str = Field(description="Hash of the steps of its plan on this bench.")
    type_prior: DesignPrior | None = Field(
        default=None, description="The prior of a type that U counts with; null: none was asked for."
    )
    decisions: list[str] = Field(description="Each choice of the recipe with its reason, a sentence each.")
    others: list[DesignedCampaign] = Field(description="The next best recipes, shortest first.")
    reference: DesignedCampaign | None = Field(
        description="The recipe that is compared with (`like`, else table1-x-table2); null: see `reference_refused`."
    )
    reference_name: str = Field(description="Name of that recipe.")
    reference_refused: str = Field(
        default="", description="Why that recipe cannot be run on the bench, or does not fit the model; empty: it can."
    )
    bound: DesignBound | None = Field(description="The least hours; null: the model has no law over the range.")
    tilted: TiltedDesign | None = Field(
        description="What a tilted fixture is worth; null: the unit has fewer than three outputs, or the data sets are "
        "at fixed temperatures."
    )
    units_at_once: int = Field(
        description="Units that one campaign measures: table.places of the bench file, else the units in it."
    )
    standards_u_dps: float | None = Field(
        description="U (k = 2) that fixture and table leave at the largest rate, whatever the noise, deg/s: beside the "
        "U of the recipe, and only by further mountings made smaller; null: not stated, or no output across the axis."
    )
    assumptions: list[str] = Field(description="Figures that the prediction counts with, and where they are from.")
    tried: int = Field(description="Number of recipes that were planned and compared.")


class EvaluateRequest(Request):
    """A recipe of fixed rates and temperatures, and the points at which they are moved."""

    recipe: RecipeSource = Field(
        description="Recipe whose points are moved; U is of the range of its own rates and temperatures."
    )
    rates_dps: list[float] | None = Field(
        default=None, min_length=1, max_length=500, description="Rates in place of its own, deg/s; null: its own."
    )
    temperatures_c: list[float] | None = Field(
        default=None,
        min_length=2,
        max_length=500,
        description="Temperatures in place of its own, deg C; null: its own.",
    )
    model: str | None = Field(
        default=None, max_length=100, description="Model to fit; null: that of the recipe, else bias_scale."
    )
    u_dps: float | None = Field(default=None, gt=0, description="U (k = 2) to reach in the range, deg/s; null: none.")


class EvaluateResponse(ResponseModel):
    """What a recipe costs and gives on the bench with its points where they are asked for."""

    bench: BenchName
    model: str | None = Field(description="Model that is fitted; null: effects alone.")
    rates_dps: list[float] = Field(description="Rates of the recipe, in its order, deg/s.")
    temperatures_c: list[float] = Field(description="Temperatures of the recipe, in its order, deg C.")
    allowed_rates_dps: Range = Field(description="Lowest and highest rate of the bench and its units, deg/s.")
    allowed_temperatures_c: Range = Field(description="Lowest and highest temperature of these, deg C.")
    use_rates_dps: Range = Field(description="Range of rates that U is of, deg/s.")
    use_temperatures_c: Range = Field(description="Range of temperatures that U is of, deg C.")
    evaluated: DesignedCampaign | None = Field(
        description="Hours and U of the recipe; null: the bench cannot run it, or it does not fit the model."
    )
    why: str = Field(default="", description="Why `evaluated` is null; empty: it is not.")
    recipe_toml: str = Field(description="The recipe with these points, TOML.")

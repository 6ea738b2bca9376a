"""A recipe as it is written: TOML, every name carries its unit, an unknown key is an error."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, Field, JsonValue, ValidationError, ValidationInfo, field_validator, model_validator
from pydantic_core import PydanticCustomError

from instruments.positions import Position as BodyPosition
from instruments.toml_documents import listed, parse_toml, read_toml_text, shown
from procedures.contracts.errors import RecipeError
from procedures.recipe.fit_rules import FitRules
from procedures.recipe.profiles import Profile
from procedures.recipe.rules import (
    AcquireRules,
    AnotherRadius,
    GuardRules,
    Indexing,
    Inverted,
    Mounting,
    Number,
    OnFailure,
    Position,
    PowerCycle,
    Ramp,
    Replicates,
    ResumeRules,
    SoakRules,
    SupplySteps,
    Table,
    Verification,
    Whole,
)
from procedures.recipe.stop_rules import StopRules, outside
from procedures.recipe.turns import TurnRules

#: A key that is not known is shown up to here.
LONGEST_KEY = 80


#: What a recipe of turns by hand has no use for: no table and no chamber is driven.
_OF_RATES = (
    "temperatures_c", "rates_dps", "order", "temperature_order", "rate_order", "repeats", "soak", "acquire",
    "replicates", "indexing", "inverted", "another_radius", "power_cycle", "supply", "ramp", "profiles",
    "verification", "stop",
)  # fmt: skip


class Recipe(Table):
    """Which temperatures, rates and positions, in which order, and how carefully.

    With `turns` a person turns the units by hand in each position, and neither a table nor a chamber is needed.
    """

    format: Literal["labctl-recipe/1"] = "labctl-recipe/1"
    name: str = Field(min_length=1)
    description: str = ""
    turns: TurnRules | None = None  #: instead of temperatures and rates
    temperatures_c: tuple[Number, ...]
    rates_dps: tuple[Number, ...]
    positions: tuple[Position, ...] = Field(min_length=1)  #: body axis along the table axis, up; tilted x+y+z
    order: Literal["position-major", "temperature-major"] = "position-major"
    #: "up_down": every second temperature on the way up, the others on the way down
    temperature_order: Literal["as_listed", "up", "down", "up_down"] = "as_listed"
    rate_order: Literal["as_listed", "ascending", "random"] = "as_listed"  #: "random": drawn anew at every level
    recalibrate_after_days: Whole | None = Field(default=None, ge=1, le=36_500)  #: how long a certification is valid
    repeats: Whole = Field(default=1, ge=1)  #: how often the rates are gone through at each level
    warm_up_s: Number = Field(default=0.0, ge=0)  #: after every switching-on
    seed: Whole = Field(default=1, ge=0)  #: of the random order
    soak: SoakRules = SoakRules()
    acquire: AcquireRules = AcquireRules()
    replicates: Replicates = Replicates()
    indexing: Indexing | None = None
    inverted: Inverted | None = None
    another_radius: AnotherRadius | None = None
    power_cycle: PowerCycle | None = None
    supply: SupplySteps | None = None
    ramp: Ramp | None = None
    verification: Verification | None = None  #: absent: nothing is measured beside what is fitted
    mounting: Mounting = Mounting()
    profiles: tuple[Profile, ...] = ()  #: courses of the rate, run at the start of each level
    guards: GuardRules = GuardRules()
    on_failure: OnFailure = OnFailure()
    resume: ResumeRules = ResumeRules()
    fit: FitRules | None = None  #: absent: a campaign ends in its recordings
    stop: StopRules | None = None  #: absent: a campaign ends with its plan

    @model_validator(mode="before")
    @classmethod
    def _without_rates(cls, document: Any) -> Any:
        """Fill in empty rates and temperatures in a recipe of turns."""
        if isinstance(document, dict) and document.get("turns") is not None:
            return {"temperatures_c": (), "rates_dps": (), **document}
        return document

    @model_validator(mode="before")
    @classmethod
    def _stop_by_fit(cls, document: Any) -> Any:
        """Take the model of [fit] where [stop] names none."""
        if not isinstance(document, dict):
            return document
        stop, fit = document.get("stop"), document.get("fit")
        if not (isinstance(stop, dict) and isinstance(fit, dict)) or "model" in stop or "effects" in stop:
            return document
        fitted = {key: fit[key] for key in ("model", "effects") if fit.get(key)}
        return {**document, "stop": {**stop, **fitted}}

    @model_validator(mode="after")
    def _stop_within(self) -> Recipe:
        """Refuse a range of [stop] beyond what is measured, and courses of the rate beside it."""
        if self.stop is None:
            return self
        if self.profiles:
            raise ValueError(
                "stop: a fit of courses of the rate takes every reading, too many to be fitted while the campaign "
                "runs; remove [stop] or profiles"
            )
        beyond = outside("rates_dps", self.stop.rates_dps, self.rates_dps, "deg/s")
        if beyond := beyond or outside("temperature_c", self.stop.temperature_c, self.temperatures_c, "deg C"):
            raise ValueError(beyond)
        return self

    @model_validator(mode="after")
    def _mountings_of_it(self) -> Recipe:
        """Refuse a ramp in a mounting that the recipe does not have, and a tilted unit that a hand is to turn."""
        if self.ramp is not None and (others := [each for each in self.ramp.positions if each not in self.positions]):
            raise ValueError(
                f"ramp.positions: {others[0]} is none of the positions of the recipe ({', '.join(self.positions)}); "
                "add it there, or leave it out"
            )
        tilted = [each for each in self.positions if BodyPosition.of(each).is_tilted]
        if self.turns is not None and tilted:
            raise ValueError(
                f"positions: {tilted[0]} is tilted, and a hand turns units about a body axis; give x, y or z"
            )
        return self

    @field_validator(*_OF_RATES)
    @classmethod
    def _of_rates(cls, value: object, info: ValidationInfo) -> object:
        """Refuse what a recipe of turns has no use for, and a recipe of rates without any."""
        listed = info.field_name in {"temperatures_c", "rates_dps"}
        if info.data.get("turns") is not None:
            if value != (() if listed else cls.model_fields[info.field_name or ""].default):
                raise ValueError(
                    "this key is for a table or a chamber, but a recipe with [turns] (turns by hand) drives "
                    "neither; remove the key"
                )
        elif listed and "turns" in info.data and not value:
            raise PydanticCustomError("too_short", "Tuple should have at least 1 item after validation, not 0")
        return value

    @property
    def motion(self) -> Literal["rates", "turns", "profile"]:
        """What moves the units, as the head of a recording of it states."""
        if self.turns is not None:
            return "turns"
        return "profile" if self.profiles else "rates"


def shipped_recipes() -> dict[str, Path]:
    """Return the recipes that come with labctl, by name."""
    folder = Path(str(resources.files("procedures.recipe"))) / "recipes"
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}


def read_recipe(source: str | Path) -> Recipe:
    """Read a shipped recipe by name, or a recipe file by path.

    Raises RecipeError naming the file, the key and what was expected there.
    """
    path = shipped_recipes().get(str(source), Path(source))
    try:
        text = read_toml_text(path)
    except tomllib.TOMLDecodeError as error:
        raise RecipeError(f"recipe {path}: not TOML: {error}; correct it") from error
    except FileNotFoundError:
        recipe_names = ", ".join(shipped_recipes())
        raise RecipeError(
            f"there is no recipe {str(source)!r}; give a recipe file, or one of the names {recipe_names}"
        ) from None
    except (OSError, UnicodeDecodeError) as error:
        raise RecipeError(f"recipe {path}: cannot be read: {error}; check path and permissions") from error
    return parse_recipe(text, source=str(path))


def parse_recipe(text: str, *, source: str = "recipe") -> Recipe:
    """Read a recipe from TOML text; `source` names it in errors. Raises RecipeError."""
    try:
        document = parse_toml(text)
    except tomllib.TOMLDecodeError as error:
        raise RecipeError(f"{source}: not TOML: {error}; correct it") from error
    return validated_recipe(document, source=source)


def validated_recipe(document: Mapping[str, object], *, source: str = "recipe") -> Recipe:
    """Return the recipe that a document describes; `source` names it in errors. Raises RecipeError."""
    try:
        return Recipe.model_validate(document)
    except ValidationError as error:
        raise RecipeError(f"{source}: {_complaints(error)}") from error


def recipe_document(recipe: Recipe) -> dict[str, JsonValue]:
    """Return a recipe as a recipe file says it; keys that have their default are left out."""
    document = recipe.model_dump(mode="json", exclude_none=True, exclude_defaults=True)
    if recipe.turns is not None:
        document = {key: value for key, value in document.items() if value != []}  # it has no rates
    return {"format": "labctl-recipe/1", "name": recipe.name, **document}


def _complaints(error: ValidationError) -> str:
    """Return everything that is wrong in one line; a list that is empty only because of its items is not said twice."""
    details: list[dict[str, Any]] = [dict(each) for each in error.errors()]
    blamed = [detail["loc"][:-1] for detail in details]
    return listed(
        _complaint(detail) for detail in details if not (detail["type"] == "too_short" and detail["loc"] in blamed)
    )


def _complaint(error: dict[str, Any]) -> str:
    """Return one line of what pydantic found: the key, what was expected and what was given."""
    location = [str(part)[:LONGEST_KEY] for part in error["loc"]]
    key = ".".join(location)
    if error["type"] == "extra_forbidden":
        near = difflib.get_close_matches(location[-1], _keys(location[:-1]), n=1)
        hint = f" (did you mean {near[0]!r}?)" if near else ""
        return f"unknown key {key!r}{hint}"
    if error["type"] == "missing":
        return f"{key!r} is missing"
    return f"{key!r}: {str(error['msg']).lower()}, not {shown(error['input'])}"


def _keys(location: list[str]) -> list[str]:
    """Return the keys that are known in the table at `location`."""
    table: type[BaseModel] = Recipe
    for part in location:
        field = table.model_fields.get(part)
        options = [field.annotation, *getattr(field.annotation, "__args__", ())] if field else []
        table = next(
            (option for option in options if isinstance(option, type) and issubclass(option, BaseModel)), Recipe
        )
    return list(table.model_fields)

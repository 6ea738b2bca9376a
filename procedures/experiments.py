"""Experiments: changes of a recipe that show what the recipe itself cannot, found by name as entry points.

Each is a building block: what it changes in a recipe, in words and as a function, and what it needs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from instruments.plugins import PluginGroup
from instruments.positions import AXES, Position
from procedures.recipe.recipe import Recipe, validated_recipe
from procedures.recipe.whole_turns import CYCLE_DEG, over_whole_turns

#: Changes of a recipe, by key; None where the recipe does not lend itself to the experiment.
Changes = Mapping[str, object] | None
#: What an experiment does not take over from the recipe: it is no calibration.
NOT_TAKEN: Mapping[str, object] = {
    "fit": None, "verification": None, "profiles": (), "indexing": None, "inverted": None, "another_radius": None,
    "power_cycle": None, "supply": None, "ramp": None,
    "replicates": {}, "repeats": 1,
}  # fmt: skip


@dataclass(frozen=True)
class Block:
    """One building block."""

    id: str  #: small letters, digits and _
    text: str  #: what is done, in words, to go on with after "Next: "
    change: Callable[[Recipe], Changes]
    needs: tuple[str, ...] = ()  #: what a bench needs besides table and chamber, in words
    tests_laws: bool = False  #: whether it is for a law without a name alone, and distinguishes no effects

    def changed(self, recipe: Recipe) -> Recipe | None:
        """Return the recipe of the experiment; None where this recipe does not lend itself to it.

        Raises RecipeError where the changes make no recipe.
        """
        changes = None if recipe.turns is not None else self.change(recipe)
        if changes is None:
            return None
        return validated_recipe({**recipe.model_dump(), **NOT_TAKEN, **changes}, source=f"experiment {self.id}")


def _checked(loaded: object) -> tuple[Block, ...]:
    blocks = tuple(loaded) if isinstance(loaded, Iterable) else (loaded,)
    for block in blocks:
        if not isinstance(block, Block):
            raise TypeError(f"{block!r} is not a Block; make one of procedures.experiments.Block")
    return tuple(block for block in blocks if isinstance(block, Block))


GROUP: PluginGroup[tuple[Block, ...]] = PluginGroup("labctl.experiments", "experiment", _checked)


def all_blocks() -> tuple[Block, ...]:
    """Return every installed block, labctl's own first."""
    return tuple(GROUP.merged(lambda blocks: ((block.id, block) for block in blocks), "experiment").values())


#: An experiment soaks no longer than this, s: that a unit has settled is criterion enough, and its temperature logged.
SHORT_SOAK_S = 1200.0
#: Temperatures of a loop, and of an experiment with several temperatures, at most.
LOOP_C, SEVERAL_C = 7, 4
#: Steps of the supply voltage, % of the nominal one: three voltages also show a curved response.
SUPPLY_PCT = (-5.0, 0.0, 5.0)
#: A slow ramp, K/min, and the least span of a ramp, K.
SLOW_C_PER_MIN, MIN_RAMP_K = 0.25, 5.0
#: From and to which frequency sines are swept, Hz, and how long a sweep takes, s.
SWEEPS_HZ, SWEEP_S = ((0.2, 1.0), (1.0, 5.0), (5.0, 20.0)), 30.0
#: Rates near rest, over the largest.
NEAR_REST = (1e-4, 3e-4, 1e-3, 3e-3, 1e-2)
#: A data set near rest takes at most so long, s.
LONGEST_S = 600.0
#: What a tilted fixture brings up in an experiment: all three axes turn at 1/sqrt(3) of the table's rate.
DIAGONAL = "x+y+z"
#: Fewer rates, or temperatures, than these have no shape between which others would lie.
MIN_RATES, MIN_TEMPERATURES = 5, 5
#: Shares of the largest rate that are close to each other in its top third.
TOP = (0.3, 0.5, *np.arange(0.66, 1.001, 0.04).tolist())


def few_rates(recipe: Recipe) -> list[float]:
    """Return rest, and a middle and the largest rate of a recipe with both signs, deg/s, rising."""
    sizes = sorted({abs(rate) for rate in recipe.rates_dps if rate})
    chosen = {sizes[len(sizes) // 2], sizes[-1]} if sizes else set()
    return sorted({0.0, *chosen, *(-size for size in chosen)})


def at_hand_c(recipe: Recipe) -> float:
    """Return the temperature of a recipe that takes the chamber the least time: nearest to where units are handled."""
    near = recipe.mounting.handling_c
    temperatures = sorted(recipe.temperatures_c)
    return temperatures[len(temperatures) // 2] if near is None else min(temperatures, key=lambda c: abs(c - near))


def spread_c(recipe: Recipe, number: int) -> list[float]:
    """Return at most so many temperatures of a recipe, deg C, rising, its lowest and highest among them."""
    temperatures = sorted(set(recipe.temperatures_c))
    places = np.linspace(0, len(temperatures) - 1, min(number, len(temperatures)))
    return [temperatures[round(place)] for place in places.tolist()]


def _short(recipe: Recipe) -> dict[str, object]:
    soak = recipe.soak
    return {"soak": {**soak.model_dump(), "hold_s": min(soak.hold_s, SHORT_SOAK_S)}}


def _one_session(recipe: Recipe) -> dict[str, object]:
    return {"mounting": {**recipe.mounting.model_dump(), "repower_each": False}}


def _at_one(recipe: Recipe, rates_dps: list[float], **changes: object) -> dict[str, object]:
    return {"temperatures_c": [at_hand_c(recipe)], "rates_dps": rates_dps, **_short(recipe), **changes}


def _turns(recipe: Recipe) -> bool:
    return any(recipe.rates_dps)


def _few(recipe: Recipe) -> Changes:
    return _at_one(recipe, few_rates(recipe), repeats=3)


def _random(recipe: Recipe) -> Changes:
    rates = sorted({*recipe.rates_dps, 0.0})
    return _at_one(recipe, rates, rate_order="random", repeats=2) if _turns(recipe) else None


def _random_at_several(recipe: Recipe) -> Changes:
    if not _turns(recipe) or len(recipe.temperatures_c) < 3:
        return None
    return {
        "temperatures_c": spread_c(recipe, SEVERAL_C), "temperature_order": "up_down", "rate_order": "random",
        **_short(recipe),
    }  # fmt: skip


def _all_up_and_down(recipe: Recipe) -> Changes:
    if len(recipe.temperatures_c) < 3:
        return None
    return {"temperature_order": "up_down", "rate_order": "random"}


def _inverted(recipe: Recipe) -> Changes:
    rates = few_rates(recipe)
    inverted = {"temperatures_c": [at_hand_c(recipe)], "rates_dps": rates}
    return _at_one(recipe, rates, inverted=inverted, **_one_session(recipe))


def _inverted_at_several(recipe: Recipe) -> Changes:
    temperatures = spread_c(recipe, 3)
    if len(temperatures) < 2:
        return None
    rates = few_rates(recipe)
    return {
        "temperatures_c": temperatures, "rates_dps": rates, **_short(recipe), **_one_session(recipe),
        "inverted": {"temperatures_c": temperatures, "rates_dps": rates},
    }  # fmt: skip


def _another_radius(recipe: Recipe) -> Changes:
    if not _turns(recipe):
        return None
    rates = few_rates(recipe)
    other = {"temperatures_c": [at_hand_c(recipe)], "rates_dps": rates}
    return _at_one(recipe, rates, another_radius=other, **_one_session(recipe))


def _turned(recipe: Recipe) -> Changes:
    if not _turns(recipe):
        return None
    rates = few_rates(recipe)
    indexing = {"unit_deg": [180], "fixture_deg": [180], "temperatures_c": [at_hand_c(recipe)], "rates_dps": rates}
    return _at_one(recipe, rates, indexing=indexing, **_one_session(recipe))


def _tilted(recipe: Recipe) -> Changes:
    mounted = [Position.of(each) for each in recipe.positions]
    straight = [str(each) for each in mounted if not each.is_tilted]
    if not _turns(recipe) or {Position.of(each).axis for each in straight} < set(AXES):
        return None
    return _at_one(recipe, few_rates(recipe), positions=[*straight, DIAGONAL], repeats=2, **_one_session(recipe))


def _one_powered_run(recipe: Recipe) -> Changes:
    if len(recipe.positions) < 2:
        return None
    return _at_one(recipe, few_rates(recipe), positions=[*recipe.positions, *recipe.positions], **_one_session(recipe))


def _power_cycles(recipe: Recipe) -> Changes:
    rates = few_rates(recipe)
    cycle = {"count": 3, "off_s": 600.0, "rates_dps": rates}
    return _at_one(recipe, rates, positions=[recipe.positions[0]], power_cycle=cycle, **_one_session(recipe))


def _supply_steps(recipe: Recipe) -> Changes:
    """The voltages forwards and backwards, so that a drift is not taken for their effect."""
    rates = few_rates(recipe)
    steps = {"deviations_pct": SUPPLY_PCT, "rates_dps": rates}
    return _at_one(recipe, rates, positions=[recipe.positions[0]], supply=steps, repeats=2, **_one_session(recipe))


def _from_switching_on(recipe: Recipe) -> Changes:
    rates = few_rates(recipe)
    lasts_s = recipe.acquire.duration_s + recipe.acquire.settle_s + 5.0
    soak = {**recipe.soak.model_dump(), "hold_s": 0.0, "drift_window_s": 10.0, "max_drift_c": 20.0}
    repeats = max(round(3600.0 / (lasts_s * len(rates))), 2)
    return _at_one(
        recipe,
        rates,
        positions=[recipe.positions[0]],
        soak=soak,
        repeats=repeats,
        warm_up_s=0.0,
        **_one_session(recipe),
    )


def _wait(recipe: Recipe) -> Changes:
    rates = few_rates(recipe)
    return _at_one(recipe, rates, positions=[recipe.positions[0]], warm_up_s=3600.0, repeats=3, **_one_session(recipe))


def _at_rest(recipe: Recipe) -> Changes:
    acquire = {**recipe.acquire.model_dump(), "duration_s": 600.0, "max_duration_s": 600.0}
    changes = _at_one(recipe, [0.0], positions=[recipe.positions[0]], acquire=acquire, repeats=12)
    return {**changes, **_one_session(recipe)}


def _loop(rate_share: float) -> Callable[[Recipe], Changes]:
    def change(recipe: Recipe) -> Changes:
        temperatures = spread_c(recipe, LOOP_C)
        if len(temperatures) < 3 or (rate_share and not _turns(recipe)):
            return None
        largest = max(abs(rate) for rate in recipe.rates_dps)
        rates = [0.0] if not rate_share else [0.0, largest, -largest]
        return {
            "temperatures_c": [*temperatures, *temperatures[-2::-1]], "temperature_order": "as_listed",
            "rates_dps": rates, "positions": [recipe.positions[0]], "repeats": 2, **_short(recipe),
        }  # fmt: skip

    return change


def _slow_loop(recipe: Recipe) -> Changes:
    loop = _loop(1.0)(recipe)
    return None if loop is None else {**loop, "soak": recipe.soak.model_dump()}


def _ramp(*, rates: Callable[[Recipe], list[float]], slow: bool) -> Callable[[Recipe], Changes]:
    def change(recipe: Recipe) -> Changes:
        low_c, high_c = min(recipe.temperatures_c), max(recipe.temperatures_c)
        if high_c - low_c < MIN_RAMP_K:
            return None
        ramp: dict[str, object] = {"from_c": low_c, "to_c": high_c, "rates_dps": rates(recipe), "back": True}
        if slow:
            ramp["c_per_min"] = SLOW_C_PER_MIN
        return {
            "temperatures_c": [low_c], "rates_dps": few_rates(recipe), "positions": [recipe.positions[0]],
            "ramp": ramp, **_short(recipe),
        }  # fmt: skip

    return change


def _sine(recipe: Recipe) -> Changes:
    """Sweeps to higher and higher frequencies, each as fast and a quarter as fast as a table may be able to.

    A bench leaves out those that its table cannot follow.
    """
    if not recipe.profiles:
        return None
    largest_dps = max(profile.course.largest_dps for profile in recipe.profiles)
    sweeps = [
        {"kind": "sine_sweep", "amplitude_dps": float(f"{share * largest_dps / to_hz:.3g}"), "from_hz": from_hz,
         "to_hz": to_hz, "duration_s": SWEEP_S}
        for from_hz, to_hz in SWEEPS_HZ
        for share in (1.0, 0.25)
    ]  # fmt: skip
    return _at_one(recipe, [0.0], positions=[recipe.positions[0]], profiles=sweeps)


def _first_again(recipe: Recipe) -> Changes:
    ends = spread_c(recipe, 2)
    if len(ends) < 2:
        return None
    return {
        "temperatures_c": ends, "rates_dps": few_rates(recipe), "repeats": 2, "positions": [recipe.positions[0]],
        "replicates": {"first_temperature_again": True}, **_short(recipe),
    }  # fmt: skip


def _top(recipe: Recipe) -> Changes:
    return _of_shares(recipe, TOP)


def _between(recipe: Recipe) -> Changes:
    """Rates half-way between those of the recipe: what the error does there was not measured."""
    rates = sorted({*recipe.rates_dps})
    if len(rates) < MIN_RATES:
        return None
    acquire = over_whole_turns(recipe, halfway := _halfway(rates))
    return {"temperatures_c": spread_c(recipe, SEVERAL_C), "rates_dps": halfway, "acquire": acquire, **_short(recipe)}


def _between_temperatures(recipe: Recipe) -> Changes:
    """Temperatures half-way between those of the recipe: what the error does there was not measured."""
    temperatures_c = sorted({*recipe.temperatures_c})
    if len(temperatures_c) < MIN_TEMPERATURES or not _turns(recipe):
        return None
    rates = few_rates(recipe)
    acquire = over_whole_turns(recipe, rates)
    return {"temperatures_c": _halfway(temperatures_c), "rates_dps": rates, "acquire": acquire, **_short(recipe)}


def _halfway(rising: list[float]) -> list[float]:
    return [float(f"{(low + high) / 2:.6g}") for low, high in pairwise(rising)]


def _near_rest(recipe: Recipe) -> Changes:
    """Rates that turn the table by whole cycles of its motor in a data set: of a part of one, the mean rate is wrong.

    A stepper at some hundredths of a degree per second makes a few steps in a data set; one more or less, as the
    readings begin, would look like a dead band.
    """
    largest_dps = max(abs(rate) for rate in recipe.rates_dps)
    if not largest_dps:
        return None
    least_dps = max(float(f"{NEAR_REST[0] * largest_dps:.2g}"), CYCLE_DEG / LONGEST_S)
    cycle_s = CYCLE_DEG / least_dps
    duration_s = cycle_s * max(round(recipe.acquire.duration_s / cycle_s), 1)
    sizes = {round(share * largest_dps / least_dps) for share in (*NEAR_REST, 0.1, 1.0)} - {0}
    rates_dps = [float(f"{sign * size * least_dps:.6g}") for size in sorted(sizes) for sign in (1, -1)]
    acquire = {**recipe.acquire.model_dump(), "duration_s": duration_s, "whole_turns_above_dps": None}
    return _at_one(recipe, [0.0, *rates_dps], acquire=acquire)


def _of_shares(recipe: Recipe, shares: tuple[float, ...]) -> Changes:
    largest = max(abs(rate) for rate in recipe.rates_dps)
    if not largest:
        return None
    sizes = [float(f"{share * largest:.4g}") for share in shares]
    return _at_one(recipe, [0.0, *(sign * size for size in sizes for sign in (1, -1))])


BLOCKS: tuple[Block, ...] = (
    Block("few_rates", "a few rates, three times, at one temperature", _few),
    Block("random_rates", "all rates in random order, twice, at one temperature", _random),
    Block("random_rates_up_down", "all rates in random order at a few temperatures up and down", _random_at_several),
    Block("whole_up_down", "the whole recipe with rates in random order, temperatures up and down", _all_up_and_down),
    Block("upside_down", "each position also upside down, in one powered run, at one temperature", _inverted),
    Block(
        "upside_down_temperatures", "each position also upside down, in one powered run, at three temperatures",
        _inverted_at_several,
    ),
    Block("turned_180", "each position also turned by 180 deg on its fixture and on the table", _turned),
    Block(
        "another_radius", "each position also at another distance from the table's axis, in one powered run",
        _another_radius,
        needs=("a fixture that can be moved to another distance from the table axis (eccentricity of the bench file)",),
    ),
    Block(
        "tilted", "each position, and tilted with x+y+z up: three axes turn at once, in one powered run", _tilted,
        needs=("a tilted fixture that brings x+y+z up (tilted_positions of the bench file)",),
    ),
    Block("one_powered_run", "all positions twice in one powered run, at one temperature", _one_powered_run),
    Block("power_cycles", "three power cycles at constant temperature", _power_cycles),
    Block(
        "supply_steps", "a few rates at three supply voltages, forwards and backwards, at one temperature",
        _supply_steps, needs=("a programmable supply of the units ([supply] of the bench file)",),
    ),
    Block("from_switching_on", "a few rates again and again for an hour from switching on", _from_switching_on),
    Block("wait", "a few rates at one temperature, an hour after switching on", _wait),
    Block("at_rest", "a record at rest of two hours", _at_rest),
    Block("loop_at_rest", "a loop of temperatures at rest", _loop(0.0)),
    Block("loop", "a loop of temperatures at rest and at the largest rate", _loop(1.0)),
    Block("slow_loop", "the same loop with the soaks of the recipe", _slow_loop),
    Block("ramp_at_rest", "at rest while the temperature rises and falls", _ramp(rates=lambda _: [0.0], slow=False)),
    Block("ramp", "a few rates while the temperature rises and falls", _ramp(rates=few_rates, slow=False)),
    Block("slow_ramp", "a few rates while the temperature rises and falls slowly", _ramp(rates=few_rates, slow=True)),
    Block("first_again", "the lowest temperature, the highest, and the lowest again, at a few rates", _first_again),
    Block("top_rates", "more rates in the top third, at one temperature", _top),
    Block("between_rates", "rates half-way between those of the recipe, at a few temperatures", _between),
    Block(
        "between_temperatures", "temperatures half-way between those of the recipe", _between_temperatures,
        tests_laws=True,
    ),
    Block("near_rest", "small rates of both signs, at one temperature", _near_rest),
    Block(
        "sine", "sines of the rate from 0.2 Hz up, as fast as the table follows, at one temperature", _sine,
        needs=("a table that follows a course of the rate (driver acutrol-3000)",),
    ),
)  # fmt: skip

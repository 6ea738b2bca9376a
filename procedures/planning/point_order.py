"""In which order a recipe's points are visited: mountings, their levels of temperature, the rates of each level."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from instruments.eccentricity import MM_PER_M
from instruments.positions import Position
from procedures.recipe.recipe import Recipe
from procedures.recipe.rules import AnotherRadius, Indexing, Inverted


@dataclass(frozen=True)
class Level:
    """One temperature with the rates that are run at it, in order."""

    temperature_c: float
    rates_dps: tuple[float, ...]


@dataclass(frozen=True)
class MountingBlock:
    """One mounting: what is measured between two turnings of the units."""

    position: str
    levels: tuple[Level, ...]
    same_session: bool = False  #: turned without being switched off, whatever the recipe says of other mountings
    verification: bool = False  #: mounted and switched on anew, and never fitted
    hold_s: float | None = None  #: of its soaks; None: that of the recipe


def order_points(recipe: Recipe) -> list[MountingBlock]:
    """Return the mountings of a recipe in order, with everything measured in each."""
    return [_with_rates(recipe, block, number) for number, block in enumerate(_blocks(recipe))]


def verification_blocks(recipe: Recipe) -> list[MountingBlock]:
    """Return the mountings in which a calibration is verified, in order, at rates and temperatures of their own."""
    rules = recipe.verification
    if rules is None:
        return []
    positions = rules.positions or recipe.positions
    lot = np.random.default_rng(rules.seed)
    temperatures_c = _drawn(recipe.temperatures_c, len(positions) * rules.temperatures, lot)
    shares = np.sort(lot.permutation(temperatures_c).reshape(len(positions), rules.temperatures), axis=1)
    return [
        MountingBlock(
            position,
            tuple(Level(at, _in_any_order(_drawn(recipe.rates_dps, rules.rates, lot), lot)) for at in share.tolist()),
            verification=True,
        )
        for position, share in zip(positions, shares, strict=True)
    ]


def _in_any_order(values: NDArray[np.float64], lot: np.random.Generator) -> tuple[float, ...]:
    return tuple(float(value) for value in lot.permutation(values))


def _drawn(listed: tuple[float, ...], number: int, lot: np.random.Generator) -> NDArray[np.float64]:
    """Return values (number,), one at random in each of as many equal parts of the listed range, to 1e-4 of it."""
    edges = np.linspace(min(listed), max(listed), number + 1)
    span = max(listed) - min(listed)
    decimals = 2 if span == 0 else max(2, 4 - int(np.floor(np.log10(span))))
    return np.round(lot.uniform(edges[:-1], edges[1:]), decimals)


def temperature_sequence(recipe: Recipe) -> tuple[float, ...]:
    """Return the temperatures of one mounting in the order in which they are visited."""
    listed = recipe.temperatures_c
    rising = tuple(sorted(listed))
    falling_half = tuple(reversed(rising[1::2]))
    order = {
        "as_listed": listed,
        "up": rising,
        "down": tuple(reversed(rising)),
        "up_down": rising[::2] + falling_half,
    }[recipe.temperature_order]
    return (*order, order[0]) if recipe.replicates.first_temperature_again else order


def _blocks(recipe: Recipe) -> list[MountingBlock]:
    """Return the mountings with the listed rates, not yet in their order within a level."""
    temperatures = temperature_sequence(recipe)
    if recipe.order == "position-major":
        visits = [(position, temperatures) for position in recipe.positions]
    else:
        visits = [(position, (temperature,)) for temperature in temperatures for position in recipe.positions]
    blocks: list[MountingBlock] = []
    for position, levels in visits:
        blocks.append(MountingBlock(position, tuple(Level(level, recipe.rates_dps) for level in levels)))
        blocks += _turned(recipe, position, levels)
    return _merged(blocks)


def _turned(recipe: Recipe, position: str, visited: tuple[float, ...]) -> list[MountingBlock]:
    """Return the mountings that follow a mounting in its powered session: turned, upside down, at another radius.

    A tilted unit is not turned about the table axis: the straight mountings separate the angle of its fixture.
    """
    straight = Position.of(position)
    tables: list[tuple[Inverted | Indexing | AnotherRadius, list[Position]]] = []
    if (rules := recipe.indexing) is not None and not straight.is_tilted:
        of_unit = [replace(straight, unit_deg=angle) for angle in rules.unit_deg]
        tables.append((rules, [*of_unit, *(replace(straight, fixture_deg=angle) for angle in rules.fixture_deg)]))
    if recipe.inverted is not None:
        tables.append((recipe.inverted, [straight.upside_down]))
    if (other := recipe.another_radius) is not None and other.radius_m is not None and not straight.is_tilted:
        tables.append((other, [straight.at_radius(round(other.radius_m * MM_PER_M))]))
    blocks = []
    for table, positions in tables:
        order_c = table.temperatures_c
        if recipe.order == "temperature-major":
            order_c = tuple(each for each in order_c if each in visited)
        levels = tuple(Level(each, table.rates_dps) for each in order_c)
        hold_s = table.hold_s if isinstance(table, Indexing) else None
        blocks += [MountingBlock(str(each), levels, same_session=True, hold_s=hold_s) for each in positions if levels]
    return blocks


def _merged(blocks: list[MountingBlock]) -> list[MountingBlock]:
    """Return the mountings with neighbours of one position as one: a unit is not turned to where it already is."""
    merged: list[MountingBlock] = []
    for block in blocks:
        if merged and merged[-1].position == block.position:
            merged[-1] = replace(merged[-1], levels=merged[-1].levels + block.levels)
        else:
            merged.append(block)
    return merged


def _with_rates(recipe: Recipe, block: MountingBlock, number: int) -> MountingBlock:
    """Return the mounting with each level's rates in their final order; `number` enters each level's random seed."""
    levels = tuple(
        Level(
            level.temperature_c,
            level.rates_dps
            if block.same_session
            else level_rates(recipe, level.rates_dps, np.random.default_rng([recipe.seed, number, index])),
        )
        for index, level in enumerate(block.levels)
    )
    return replace(block, levels=levels)


def level_rates(recipe: Recipe, listed: tuple[float, ...], lot: np.random.Generator) -> tuple[float, ...]:
    """Return one level's rates in the order in which they are run, with its replicates."""
    zero_at = recipe.replicates.zero_rate
    rates = [rate for rate in listed * recipe.repeats if not (zero_at and rate == 0)]
    if recipe.rate_order == "ascending":
        rates.sort()
    elif recipe.rate_order == "random":
        rates = [rates[index] for index in lot.permutation(len(rates))]
    again = min(recipe.replicates.repeated_rates, len(set(rates)))
    for rate in lot.choice(sorted(set(rates)), size=again, replace=False) if again else ():
        rates.insert(int(lot.integers(len(rates) + 1)), float(rate))
    if "middle" in zero_at:
        rates.insert((len(rates) + 1) // 2, 0.0)
    start = [0.0] if "start" in zero_at else []
    end = [0.0] if "end" in zero_at else []
    return (*start, *rates, *end)

"""A designed campaign as text."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from labctl.cli.output import console, format_number, print_heading, table

if TYPE_CHECKING:
    from labctl.answers.design import DesignBound, DesignedCampaign, DesignPrior, DesignResponse, TiltedDesign


def print_design(answer: DesignResponse, out: Path) -> None:
    """Print the choice with its reasons, what it was compared with, and the bound."""
    model = "+".join(filter(None, [answer.model, *answer.effects]))
    (low_c, high_c), (_, most_dps) = answer.temperatures_c, answer.rates_dps
    print_heading(str(out), f" on {answer.bench}: {model}, {low_c:g} to {high_c:g} deg C, up to {most_dps:g} deg/s")
    for sentence in answer.decisions:
        console.print(f"  {sentence}", soft_wrap=True)
    rows = table(
        "\nrecipes, U (k = 2) in deg/s", "", "recipe", "hours", "largest U", "rms U", "by heat", "data sets", numbers=5
    )
    for name, each in _listed(answer):
        rows.add_row(*_row(name, each))
    console.print(rows)
    if answer.reference_refused:
        console.print(f"  {answer.reference_name}: {answer.reference_refused}", style="yellow", soft_wrap=True)
    if answer.type_prior is not None:
        _print_type_prior(answer.type_prior, answer.chosen)
    if answer.bound is not None:
        _print_bound(answer.bound)
    if answer.tilted is not None:
        _print_tilted(answer.tilted)
    if answer.units_at_once > 1:
        console.print(
            f"  {answer.units_at_once} units at once: {answer.chosen.hours_per_unit:.2g} h per unit", soft_wrap=True
        )
    if answer.standards_u_dps is not None:
        console.print(
            f"  beside it fixture and table leave {answer.standards_u_dps:.2g} deg/s at {most_dps:g} deg/s, whatever "
            "the recipe; `labctl campaign plan` says which further mountings make it smaller",
            soft_wrap=True,
        )
    for assumption in answer.assumptions:
        console.print(f"  counted with: {assumption}", soft_wrap=True)


def _listed(answer: DesignResponse) -> list[tuple[str, DesignedCampaign]]:
    """Return the recipes of an answer, each with what it is."""
    listed = [("chosen", answer.chosen), *(("", each) for each in answer.others)]
    if answer.type_prior is not None and answer.type_prior.without is not None:
        listed.append(("without the prior", answer.type_prior.without))
    if answer.reference is not None:
        listed.append((answer.reference_name, answer.reference))
    return listed


def _print_type_prior(prior: DesignPrior, choice: DesignedCampaign) -> None:
    without = prior.without
    beside = "no recipe was found without it"
    if without is not None:
        reach = "" if without.is_reaching else ", which does not reach the goal"
        beside = f"without it {without.hours:.1f} h for U = {format_number(without.u_worst_dps, 2)} deg/s{reach}"
    console.print(
        f"  with the prior of {prior.units} units of type {prior.type} by {prior.model}: {choice.hours:.1f} h for "
        f"U = {format_number(choice.u_worst_dps, 2)} deg/s; {beside}. The recipe's fit uses the prior; `labctl fit "
        "--type-prior` does the same",
        soft_wrap=True,
    )


def _row(name: str, each: DesignedCampaign) -> tuple[str, ...]:
    figures = (each.u_worst_dps, each.u_rms_dps, each.u_heat_dps)
    return name, each.text, f"{each.hours:.1f}", *(format_number(value, 2) for value in figures), str(each.datasets)


def _print_tilted(tilted: TiltedDesign) -> None:
    have = "the tilted fixture" if tilted.is_on_bench else "a tilted fixture, which the bench file does not state,"
    best, without = tilted.best, tilted.without
    others = f"; without it {without.hours:.1f} h for U = {without.u_worst_dps:.2g} deg/s" if without else ""
    bound = f" (at best {tilted.bound.bound_h:.2g} h)" if tilted.bound else ""
    console.print(
        f"  with {have} that brings {tilted.position} up: {best.hours:.1f} h for U = {best.u_worst_dps:.2g} deg/s"
        f"{bound}{others}",
        soft_wrap=True,
    )


def _print_bound(bound: DesignBound) -> None:
    console.print(
        f"  at best {bound.bound_h:.2g} h: {bound.heat_h:.2g} h of ramps and mountings, {bound.noise_h:.2g} h of "
        f"readings to average the white noise; the chosen recipe takes {bound.ratio:.2g} times as long",
        soft_wrap=True,
    )

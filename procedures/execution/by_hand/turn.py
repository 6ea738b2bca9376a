"""A turn by hand: a rest, the turn, a rest, read without a gap; checked at once, and asked again until it is good."""

from __future__ import annotations

from dataclasses import dataclass, replace

from procedures.contracts.errors import StepFailed
from procedures.contracts.journal import Event
from procedures.contracts.operator import Prompt
from procedures.contracts.steps import Turn
from procedures.execution.by_hand.readings import TurnReadings
from procedures.execution.context import ExecutionContext
from procedures.execution.prompting import ask
from procedures.monitoring.progress import TurnProgress
from procedures.monitoring.turn_check import TurnResult, check_turn, moved
from procedures.recipe.turns import TurnRules


def turn(context: ExecutionContext, step: Turn) -> dict[str, float]:
    """Have the units turned until a turn is good; returns what came out of it, by unit.

    Raises StepFailed after as many refused attempts as the recipe allows, and for an answer that does not come, or is
    no; InstrumentError, Aborted.
    """
    rules = context.recipe.turns
    assert rules is not None
    refused = ""
    try:
        for attempt in range(1, rules.attempts + 1):
            shown = TurnProgress(step.position, step.turn_deg, "rest", attempt, refused=refused)
            context.recorder.tracker.update(turn=shown)
            found = _attempt(context, step, rules, shown)
            if not found.refused:
                return {"attempts": float(attempt), **found.figures}
            refused = found.refused
    finally:
        context.recorder.tracker.update(turn=None)
    raise StepFailed(
        f"the turn by {step.turn_deg:g} deg, {step.position} up, was refused {rules.attempts} times, the last time "
        f"because: {refused}; inspect unit and readings, then resume the campaign"
    )


@dataclass(frozen=True)
class _Found:
    """Result of one attempt."""

    refused: str  #: why; empty for a good one
    figures: dict[str, float]  #: what came out of each unit


def _attempt(context: ExecutionContext, step: Turn, rules: TurnRules, shown: TurnProgress) -> _Found:
    readings = TurnReadings(context, step, rules.still_dps)
    try:
        refused, again = _rest(readings, step, rules), False
        if not refused:
            context.recorder.tracker.update(turn=(shown := replace(shown, phase="turn")))
            answer = ask(context, _question(context, step, rules, shown), lambda: readings.read_turn(shown))
            readings.read_turn(shown)  # what came with the answer
            readings.end_turn()
            again = answer.again
            refused = (answer.reason or f"{answer.by} requested the turn again") if again else ""
        else:
            readings.close(refused)
            _ask_for_rest(context, step, rules, refused)
            return _record(context, step, refused, {})
        results: dict[str, TurnResult] = {}
        if not again:
            context.recorder.tracker.update(turn=replace(shown, phase="rest", came_deg=readings.came_deg))
            readings.rest_after(step.rest_s)
            results = {unit.name: check_turn(step, rules, unit) for unit in readings.units()}
            named = len(results) > 1
            refused = next((f"{n}: {r.refused}" if named else r.refused for n, r in results.items() if r.refused), "")
    except BaseException as error:
        readings.close(str(error) or type(error).__name__)
        raise
    readings.close(refused)
    return _record(context, step, refused, results)


def _rest(readings: TurnReadings, step: Turn, rules: TurnRules) -> str:
    """Take the rest before the turn; returns what moved in it, empty when nothing did."""
    readings.rest_before(step.rest_s)
    return next((text for course in readings.before() if (text := moved(course, rules.still_dps, "before"))), "")


def _question(context: ExecutionContext, step: Turn, rules: TurnRules, shown: TurnProgress) -> Prompt:
    text = rules.ask.of(rules.ask.turn, step.position, step.turn_deg)
    text = f"{shown.refused}: turn again; {text}" if shown.refused else text
    return Prompt(context.new_prompt_id(), "turn", text, step.position, step.turn_deg, step.within_s)


def _ask_for_rest(context: ExecutionContext, step: Turn, rules: TurnRules, refused: str) -> None:
    text = f"{refused}: {rules.ask.of(rules.ask.keep_still, step.position)}"
    ask(context, Prompt(context.new_prompt_id(), "mount", text, step.position, within_s=step.within_s))


def _record(context: ExecutionContext, step: Turn, refused: str, results: dict[str, TurnResult]) -> _Found:
    """Write down what came out, of every unit that measures the axis, and whether it was refused."""
    asked = f"turn by {step.turn_deg:g} deg, {step.position} up"
    figures = {f"came_deg.{name}": result.came_deg for name, result in results.items() if result.came_deg is not None}
    if refused:
        value = next(iter(figures.values()), None)
        event = Event("turn.refused", f"{asked}: {refused}: turn again", "warning", None, value, step.turn_deg, "deg")
        context.recorder.event(event)
    else:
        for name, result in results.items():
            came = result.came_deg
            text = (
                f"{asked}: the unit turned by {came:.1f} deg"
                if came is not None
                else f"{asked}: {name} has no such axis"
            )
            context.recorder.event(Event("turn.taken", text, "info", name, came, step.turn_deg, "deg"))
    return _Found(refused, figures)

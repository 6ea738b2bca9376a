"""U of a campaign as its events say it; light to load, as a status is asked for often."""

from __future__ import annotations

from bisect import bisect_right

from labctl.answers.campaigns import CampaignResponse
from labctl.answers.sufficiency import (
    TargetResponse,
    TargetUnitResponse,
    UncertaintyCourse,
    UncertaintyCourseResponse,
)
from labctl.services.sufficiency.event_kinds import KNOWN
from labctl.store import EventRow, Store
from procedures.recipe.recipe import Recipe


def with_target(store: Store, answer: CampaignResponse) -> CampaignResponse:
    """Return the status of a campaign with the U that ends it, and how far each unit is."""
    stored = store.campaigns.get(answer.id).recipe
    if stored.get("stop") is None:
        return answer
    recipe = Recipe.model_validate(dict(stored))
    rules = recipe.stop
    assert rules is not None
    newest = {event.device or "": event for event in _evaluations(store, answer.id)}
    target = TargetResponse(
        u_dps=rules.u_dps,
        model=rules.model,
        effects=list(rules.effects),
        rates_dps=list(rules.rates_dps or (min(recipe.rates_dps), max(recipe.rates_dps))),
        temperature_c=list(rules.temperature_c or (min(recipe.temperatures_c), max(recipe.temperatures_c))),
        repeatability=rules.repeatability,
        units=[
            TargetUnitResponse(gyro=gyro, known=KNOWN[event.kind], u_dps=event.value, text=event.message)
            for gyro, event in newest.items()
        ],
    )
    return answer.model_copy(update={"target": target})


def uncertainty_course(store: Store, campaign: int) -> UncertaintyCourseResponse:
    """Return U of each unit as it fell while the campaign ran. Raises NotFound."""
    stored = store.campaigns.get(campaign).recipe
    steps = [step for step in store.campaigns.steps(campaign) if step.kind == "acquire"]
    fitted = [step for step in steps if not step.body.get("verification")]
    ended_s = sorted(step.ended_s for step in fitted if step.state == "done" and step.ended_s is not None)
    units: dict[str, list[EventRow]] = {}
    for event in _evaluations(store, campaign):
        units.setdefault(event.device or "", []).append(event)
    stop = stored.get("stop")
    return UncertaintyCourseResponse(
        campaign=campaign,
        target_u_dps=None if stop is None else Recipe.model_validate(dict(stored)).stop.u_dps,  # type: ignore[union-attr]
        planned=len(fitted),
        units={
            gyro: UncertaintyCourse(
                datasets=[bisect_right(ended_s, event.t_s) for event in events],
                t_s=[event.t_s for event in events],
                u_dps=[event.value for event in events],
                known=[KNOWN[event.kind] for event in events],
            )
            for gyro, events in units.items()
        },
    )


def _evaluations(store: Store, campaign: int) -> list[EventRow]:
    return store.campaigns.events(campaign, kinds=tuple(KNOWN))

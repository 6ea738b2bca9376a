"""Asking the operator: the question, the wait for the answer with reminders, and the time limit of the recipe."""

from __future__ import annotations

import math
from collections.abc import Callable

from procedures.contracts.campaign_state import CampaignState
from procedures.contracts.errors import StepFailed, Unanswered
from procedures.contracts.journal import Event
from procedures.contracts.operator import Answer, Prompt
from procedures.execution.context import POLL_S, ExecutionContext
from procedures.execution.waiting import CHECK_S, pass_time
from procedures.monitoring.event_recorder import warning


def ask(context: ExecutionContext, prompt: Prompt, meanwhile: Callable[[], None] | None = None) -> Answer:
    """Ask the operator and wait for the answer, with the environment recorded.

    `meanwhile` is called repeatedly instead of waiting; each call takes about a second.
    Raises StepFailed when the answer is no, Unanswered when none comes in time, and what `ExecutionContext.polls` and
    `meanwhile` raise.
    """
    context.recorder.event(Event("operator.asked", f"{prompt.text} [question {prompt.id}]"))
    context.operator.ask(prompt)
    answer = context.operator.answer(prompt.id)
    if answer is None:
        answer = _wait_for_answer(context, prompt, meanwhile)
    if answer.again:
        reason = f": {answer.reason}" if answer.reason else ""
        context.recorder.event(
            Event(f"operator.{prompt.kind}", f"{prompt.text}: {answer.by} requests it again{reason}")
        )
        return answer
    if not answer.confirmed:
        raise StepFailed(f"{answer.by} declined: {prompt.text}: {answer.reason}")
    context.recorder.event(Event(f"operator.{prompt.kind}", f"{prompt.text}: confirmed by {answer.by}"))
    return answer


def _wait_for_answer(context: ExecutionContext, prompt: Prompt, meanwhile: Callable[[], None] | None) -> Answer:
    """Wait for the answer with the campaign in the state `waiting`."""
    recorder = context.recorder
    recorder.tracker.update(prompt=prompt)
    recorder.change_state(CampaignState.WAITING, prompt.text)
    try:
        with context.monitor.attended():
            answer = _poll_until_answered(context, prompt, meanwhile)
    finally:
        context.operator.withdraw(prompt.id)
        recorder.tracker.update(prompt=None)
    recorder.change_state(CampaignState.RUNNING, f"answered by {answer.by}")
    return answer


def _poll_until_answered(context: ExecutionContext, prompt: Prompt, meanwhile: Callable[[], None] | None) -> Answer:
    rules, clock = context.recipe.on_failure, context.clock
    timeout_s, remind_s = prompt.within_s or rules.operator_timeout_s, rules.operator_remind_s or math.inf
    began_s = next_poll_s = clock.now_s()
    remind_at_s = began_s + remind_s
    while (answer := context.operator.answer(prompt.id)) is None:
        if timeout_s is not None and clock.now_s() - began_s >= timeout_s:
            raise Unanswered(f"no answer within {timeout_s:g} s to the request: {prompt.text}")
        if clock.now_s() >= remind_at_s:
            remind_at_s += remind_s
            text = f"{prompt.text} [question {prompt.id}], open since {clock.now_s() - began_s:.0f} s"
            context.recorder.event(warning("operator.reminded", text))
        if meanwhile is not None:
            meanwhile()
            continue
        if clock.now_s() >= next_poll_s:
            context.poll()
            next_poll_s = clock.now_s() + POLL_S
        pass_time(context, CHECK_S, pausing=False)
    return answer

"""Which calls the bench process takes: the transactions of the store, the acts on the bench, and questions about it.

The types of arguments and answers are those that the methods themselves declare.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import get_type_hints

from labctl.answers.campaigns import CampaignResponse
from labctl.processes.rpc_methods import RpcMethod, parameter, supervisor_method
from labctl.services.commands.acts.catalogue import BENCH_ACTS
from labctl.services.local_bench import LocalBench
from labctl.store.store import transactions


@dataclass(frozen=True)
class Beat:
    """What a watcher hears: that the process lives, and what it does."""

    running: int | None  #: the campaign
    stops: bool
    schedule_trouble: str
    not_stopped: str = ""  #: what is known of a stop that is late; empty: none is


@cache
def method_of(name: str) -> RpcMethod:
    """Return the method of a call of the bench process. Raises BadInput for a name that is none."""
    area, _, rest = name.partition(".")
    if area == "store" and (method := transactions().get(rest)):
        return RpcMethod.of_method(name, method)
    if area == "control" and rest in BENCH_ACTS:
        hints = get_type_hints(BENCH_ACTS[rest].in_service)
        return RpcMethod(name, [parameter("request", hints["request"])], hints["return"])
    made = _QUESTIONS.get(name)
    return supervisor_method(name) if made is None else made(name)


_QUESTIONS: dict[str, Callable[[str], RpcMethod]] = {
    "watch": lambda name: RpcMethod(name, [], Beat),
    "bench.live": lambda name: RpcMethod(name, [parameter("campaign", int)], tuple[bool, CampaignResponse | None]),
    "bench.describe": lambda name: RpcMethod.of_method(name, LocalBench.describe),
    "bench.live_state": lambda name: RpcMethod.of_method(name, LocalBench.live_state),
    "bench.live_history": lambda name: RpcMethod.of_method(name, LocalBench.live_history),
}

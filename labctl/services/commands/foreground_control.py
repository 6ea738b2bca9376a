"""Control over campaigns in a process without a service: a campaign runs in its foreground until it is over."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass

from instruments.bench_config import BenchFile
from instruments.clock import SystemClock
from labctl.answers.benches import BenchCheckResponse
from labctl.answers.campaigns import CampaignResponse, StartRequest
from labctl.answers.drafts import DraftsRequest
from labctl.answers.schedule import ScheduledResponse
from labctl.errors import BadInput
from labctl.services.benches.check import check_bench
from labctl.services.campaigns.execution import AskClear, Attend, Observe, run_here
from labctl.services.campaigns.resume import resume_here
from labctl.services.commands.context import BenchAct, CommandContext, RequestT, ResponseT
from labctl.services.commands.requests import CampaignResume, CampaignStart
from labctl.services.drafts.answers import with_drafts
from labctl.services.planning.loading import bench_for, load_bench, load_recipe
from labctl.services.schedule import queue
from labctl.store import open_store
from procedures.contracts.campaign_state import CampaignState


@dataclass(frozen=True)
class CampaignTerminal:
    """Terminal of a campaign in the foreground: its progress, its prompts and its messages."""

    observe: Observe | None = None
    attend: Attend | None = None
    say: Callable[[str], None] | None = None
    ask_clear: AskClear | None = None


#: Opens the terminal for the time of one campaign.
OpenTerminal = Callable[[], AbstractContextManager[CampaignTerminal]]


@contextmanager
def no_terminal() -> Iterator[CampaignTerminal]:
    """Run a campaign without a terminal."""
    yield CampaignTerminal()


class ForegroundControl:
    """Campaigns run here and now, in stores that they open themselves; no other process runs any."""

    def __init__(self, database: str, open_terminal: OpenTerminal = no_terminal) -> None:
        self._database = database
        self._open_terminal = open_terminal

    def bench_of(self, request: CampaignStart) -> BenchFile:
        """Return the bench that a start names, or the shipped one that fits its recipe."""
        return load_bench(request.bench or bench_for(load_recipe(request.body.recipe)))

    def own_bench(self) -> BenchFile | None:
        """Return None: each campaign names its bench."""
        return None

    def perform(self, act: BenchAct[RequestT, ResponseT], context: CommandContext, request: RequestT) -> ResponseT:
        """Carry out an act in this process."""
        return act.in_foreground(self, context, request)

    def run_campaign(self, request: CampaignStart) -> CampaignResponse:
        """Run a campaign in this process until it is over."""
        start_request = StartRequest(
            recipe=request.body.recipe, bench=request.bench, clip=request.body.clip, hide=request.body.hide,
            fit=request.body.fit, speed=request.speed, seed=request.seed, simulated_start=request.simulated_start,
            confirmed_by=request.body.confirmed_by, checks=request.body.checks,
        )  # fmt: skip
        with self._open_terminal() as terminal:
            answer = run_here(
                self._database, start_request, terminal.observe, terminal.attend, terminal.say, terminal.ask_clear,
                wire_log=request.wire_log,
            )  # fmt: skip
        return self._with_drafts(answer)

    def _with_drafts(self, answer: CampaignResponse) -> CampaignResponse:
        """Make the drafts of a campaign that has run here: the bench is closed, and no other process makes them."""
        if answer.state is not CampaignState.DONE:
            return answer
        with open_store(self._database, write=True) as store:
            if not store.drafts.is_awaited(answer.id):
                return answer
            from labctl.services.drafts.make import make_drafts  # noqa: PLC0415  it loads the libraries of the fit

            now = SystemClock().utc()
            at = max(now, answer.ended_at or now)  # a simulated campaign may end in another year
            make_drafts(store, answer.id, DraftsRequest(), at)
            return with_drafts(store, answer)

    def schedule(self, context: CommandContext, request: CampaignStart) -> ScheduledResponse:
        """Enter a campaign into the schedule of a bench; a service that holds this bench and database starts it."""
        options: dict[str, object] = {
            "--speed": request.speed, "--seed": request.seed, "--simulated-start": request.simulated_start,
            "--wire-log": request.wire_log,
        }  # fmt: skip
        for option, value in options.items():
            if value is not None:
                raise BadInput(
                    f"{option} {value}: only the service that runs scheduled starts sets this option; leave the "
                    "option out"
                )
        bench = self.bench_of(request)
        answer = queue.add_start(context.store, request.body, bench, context.now())
        note = "; ".join(filter(None, (queue.NO_SERVICE.format(bench=bench.name), answer.note)))
        return answer.model_copy(update={"note": note})

    def resume_campaign(self, request: CampaignResume) -> CampaignResponse:
        """Resume a campaign in this process and run it until it is over."""
        with self._open_terminal() as terminal:
            answer = resume_here(
                self._database, request.campaign, request.bench, request.speed, request.body, terminal.observe,
                terminal.attend, request.wire_log,
            )  # fmt: skip
        return self._with_drafts(answer)

    def check(self, bench: str) -> BenchCheckResponse:
        """Check a bench by its file or its shipped name, in this process."""
        return check_bench(bench)

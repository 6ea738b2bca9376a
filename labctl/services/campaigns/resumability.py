"""Whether a campaign may be resumed here and now, and why not."""

from __future__ import annotations

from collections.abc import Callable

from instruments.bench_config import BenchFile
from labctl.answers.campaigns import CampaignResponse
from labctl.services.benches.driving_process import whereabouts
from labctl.store import ResumePoint, Store
from labctl.texts import NO_BENCH
from procedures.contracts.campaign_state import CampaignState

#: A campaign that was resumed so often without finishing a step needs a person.
MAX_RESUMES = 5
#: Why a campaign cannot be resumed here, and where it can.
RESUME_ELSEWHERE = f"{NO_BENCH}; start a service on the bench of the campaign, or run `labctl campaign resume`"


def retries_exhausted(standing: ResumePoint) -> str | None:
    """Return why a campaign is not resumed automatically any more, or None."""
    if standing.tries < MAX_RESUMES:
        return None
    return (
        f"resumed {standing.tries} times without finishing a step; inspect the bench, then run `labctl campaign resume`"
    )


def _nothing() -> None:
    """Nothing runs on the bench."""


def with_resume(
    store: Store,
    answer: CampaignResponse,
    bench: BenchFile | None = None,
    running: Callable[[], int | None] = _nothing,
) -> CampaignResponse:
    """Return the status with `resumable` and `resume_reason`.

    `bench` is where it would be resumed, by default the campaign's own; `running` returns the campaign that runs there.
    """
    resumable, reason = _standing(store, answer, bench, running)
    return answer.model_copy(update={"resumable": resumable, "resume_reason": reason})


def _standing(
    store: Store, answer: CampaignResponse, bench: BenchFile | None, running: Callable[[], int | None]
) -> tuple[bool, str]:
    if answer.state is CampaignState.PAUSED and not answer.abandoned:
        return True, ""
    if answer.state is CampaignState.DONE:
        return False, "it is done"
    if answer.active:
        return False, f"it is {answer.state}"
    if refused := _refusal(store, answer, bench, running()):
        return False, refused
    return True, retries_exhausted(store.resume_points.of_campaign(answer.id)) or ""


def _refusal(store: Store, answer: CampaignResponse, bench: BenchFile | None, running: int | None) -> str:
    """Return why a resume would be refused, empty when it would not."""
    name = answer.bench if bench is None else bench.name
    if bench is not None and store.is_shared and name != answer.bench:
        return f"the campaign is resumed on its own bench only; {whereabouts(store, answer.bench)}"
    if bench is not None and {gyro.serial for gyro in bench.gyros} != set(answer.recordings):
        return f"bench {name} has other units than those that the campaign measures; name the bench of the campaign"
    if running not in {None, answer.id}:  # its own end is being written: by the time of a resume it is over
        return f"campaign {running} runs on bench {name} now; wait for the end of that campaign, or abort it"
    if text := store.benches.unconfirmed(name):
        return f"the safe state of bench {name} is not confirmed ({text}); inspect the bench first"
    return ""

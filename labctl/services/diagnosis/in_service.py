"""Diagnoses in a service: criticisms are its computations, and campaigns are entries of its schedule.

The schedule begins a campaign once the bench is free, and once only; a bench that was stopped stays so.
"""

from __future__ import annotations

from collections.abc import Callable

from instruments.bench_config import BenchFile
from labctl.answers.campaigns import BENCH_CHECKS, CampaignRequest
from labctl.answers.criticism import CriticismResponse
from labctl.services.criticism.criticise import criticise_unit
from labctl.services.diagnosis.advance import CannotBeDone, ExperimentStart, NotBegun
from labctl.services.schedule.times import NOW
from labctl.store import CampaignRow, StartRow, Store


def criticise_together(store: Store, serial: str, version: int, recordings: tuple[int, ...]) -> CriticismResponse:
    """Judge a version by several recordings together. Raises LabctlError."""
    return criticise_unit(store, serial, version, None, recordings=recordings)


class ServiceLaboratory:
    """Criticises in the workers of a service, and measures on its bench."""

    def __init__(
        self,
        store: Store,
        criticise: Callable[[str, int, tuple[int, ...]], CriticismResponse],
        schedule: Callable[[CampaignRequest], object],
    ) -> None:
        """`criticise` computes in another process where there is one; `schedule` enters a campaign into the queue."""
        self._store, self._criticise, self._schedule = store, criticise, schedule

    def criticise(self, serial: str, version: int, recordings: list[int]) -> CriticismResponse:
        """Judge a version by several recordings together."""
        return self._criticise(serial, version, tuple(recordings))

    def start(self, experiment: ExperimentStart) -> None:
        """Enter a campaign into the schedule, for its time or as soon as the bench is free.

        Where it is there, see how it fares.
        """
        entry = self._entry(experiment)
        if entry is not None:
            self._refuse_failed(entry)
            return
        request = CampaignRequest(
            recipe=experiment.recipe, fit=False, hide=hidden_in(experiment.bench),
            at=NOW if experiment.begins_at is None else experiment.begins_at.isoformat(),
            confirmed_by=experiment.confirmed_by, checks=list(BENCH_CHECKS) if experiment.confirmed_by else [],
        )  # fmt: skip
        self._schedule(request)

    def _entry(self, experiment: ExperimentStart) -> StartRow | None:
        """Return the entry of an experiment that was made since it was decided; None for none yet."""
        entries = (
            row
            for row in self._store.starts.all(ended=True)
            if row.recipe_name == experiment.name and row.created_at >= experiment.since
        )
        return max(entries, key=lambda row: row.id, default=None)

    def _refuse_failed(self, entry: StartRow) -> None:
        if entry.state == "cancelled":
            raise CannotBeDone("its scheduled start was cancelled by a person")
        events = self._store.starts.events(entry.id)
        if entry.state == "missed":
            raise NotBegun(events[-1].message)
        if events and events[-1].outcome == "refused":
            raise CannotBeDone(events[-1].message)

    def go_on(self, campaign: CampaignRow, *, resumed: bool) -> bool:
        """Leave a campaign to the service's bench, which resumes what was interrupted; it is not over."""
        del campaign, resumed
        return False


def hidden_in(bench: BenchFile) -> list[str]:
    """Return what is hidden in the units of a simulated bench, as the start of a campaign states it."""
    if bench.simulation is None or not bench.is_simulated:
        return []
    return [f"{effect}={size}" for effect, size in bench.simulation.hidden.items()]

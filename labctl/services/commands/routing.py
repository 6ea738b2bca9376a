"""Commands on a database to which several processes write: a bench's campaigns are commanded where it is driven."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager

from instruments.clock import Clock
from labctl.answers.benches import CheckRequest
from labctl.answers.diagnosis import DiagnosisRequest
from labctl.services.benches.lease import driver_of
from labctl.services.commands.command import Command, CommandExecutor, RequestT, ResponseT
from labctl.services.commands.requests import (
    Addressed,
    CampaignResume,
    CampaignStart,
    ToBench,
    ToCampaign,
    ToDiagnosis,
    ToUnit,
)
from labctl.services.diagnosis.experiment_bench import bench_of_unit
from labctl.services.planning.loading import bench_for, load_bench, load_recipe
from labctl.store import Store

OpenStore = Callable[[], AbstractContextManager[Store]]


def bench_of(store: Store, request: object) -> str | None:
    """Return the bench that a request is about; None for any other. Raises NotFound, BadInput."""
    if isinstance(request, CampaignStart):
        return load_bench(request.bench or bench_for(load_recipe(request.body.recipe))).name
    if isinstance(request, ToCampaign | CampaignResume) and request.campaign is not None:
        return store.campaigns.get(request.campaign).bench_name
    if isinstance(request, ToDiagnosis):
        return store.diagnoses.get(request.diagnosis).bench_name
    if isinstance(request, ToBench):
        return load_bench(request.bench).name if isinstance(request.body, CheckRequest) else request.bench
    if isinstance(request, ToUnit) and isinstance(request.body, DiagnosisRequest):
        return bench_of_unit(store, request.serial, None).name
    return None


class RoutedExecutor:
    """Sends what is about a bench to the service that drives it, and has everything else executed here."""

    def __init__(
        self, local: CommandExecutor, remote: Callable[[str], CommandExecutor], open_store: OpenStore, clock: Clock
    ) -> None:
        self._local, self._remote, self._open_store, self._clock = local, remote, open_store, clock

    def execute(self, command: Command[RequestT, ResponseT], request: RequestT) -> ResponseT:
        """Execute a command where it belongs. Raises LabctlError."""
        with self._open_store() as store:
            bench = bench_of(store, request)
            driver = None if bench is None else driver_of(store, bench, self._clock.utc())
        if bench is None or driver is None or driver.url is None:
            return self._local.execute(command, request)
        if isinstance(request, Addressed):
            request = request.to_driver(bench)
        return self._remote(driver.url).execute(command, request)

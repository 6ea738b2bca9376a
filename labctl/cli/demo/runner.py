"""Context of the demo: database, folder and console, and the campaigns and fits that its parts share."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from pydantic import JsonValue
from rich.console import Console

from instruments.bench_config import BenchFile, SimulationSettings
from instruments.clock import Clock, VirtualClock
from labctl.answers.calibrations import FitRequest, FitResponse
from labctl.answers.campaigns import CampaignResponse
from labctl.cli.progress_bar import CampaignProgress
from labctl.fitting import FitData, fit_data_of
from labctl.services.calibrations.fitting import fit_unit
from labctl.services.campaigns.execution import run
from labctl.services.campaigns.preparation import prepare
from labctl.services.campaigns.status import answer_of
from labctl.services.planning.loading import load_bench
from labctl.store import Store
from procedures.contracts.campaign_state import CampaignState
from procedures.monitoring.progress import Progress


@dataclass
class DemoRunner:
    """Context of the demo, and the figures that its parts have found so far."""

    store: Store
    folder: Path
    console: Console
    quiet: bool
    figures: dict[str, JsonValue] = field(default_factory=dict)

    def title(self, text: str) -> None:
        """Print the title of a part."""
        self.console.print(f"\n{text}", style="bold")

    def say(self, text: str) -> None:
        """Print a line."""
        self.console.print(text)

    def campaign(
        self,
        recipe: str,
        bench: str,
        *,
        noise_seed: int = 0,
        hidden: dict[str, float] | None = None,
        serial: str | None = None,
    ) -> CampaignResponse:
        """Run a recipe on a simulated bench in virtual time, with progress and time left."""
        settings = load_bench(bench)
        simulation = (settings.simulation or SimulationSettings()).model_copy(
            update={"noise_seed": noise_seed, "hidden": hidden or {}}
        )
        gyros = settings.gyros if serial is None else (settings.gyros[0].model_copy(update={"serial": serial}),)
        return self.run(recipe, settings.model_copy(update={"simulation": simulation, "gyros": gyros}), VirtualClock())

    def run(self, recipe: str, settings: BenchFile, clock: Clock) -> CampaignResponse:
        """Run a recipe on a bench, with progress and time left."""
        prepared = prepare(self.store, recipe, settings, clock, clip=False, fit=False)
        row = self.store.campaigns.get(prepared.id)
        with CampaignProgress(quiet=self.quiet, title=f"campaign {prepared.id}") as bar:

            def seen(progress: Progress) -> None:
                bar.update(answer_of(row, progress))

            answer = run(self.store, prepared, observe=seen)
        if answer.state is not CampaignState.DONE:
            raise RuntimeError(
                f"campaign {answer.id} of the demo ended in the state {answer.state}: {answer.reason}; "
                "run the demo again"
            )
        assert answer.started_at is not None
        assert answer.ended_at is not None
        hours = (answer.ended_at - answer.started_at).total_seconds() / 3600
        recording = self.store.recordings.get(next(iter(answer.recordings.values())))
        self.say(
            f"campaign {answer.id}: {recording.datasets} data sets, {recording.readings:,} readings, "
            f"{hours:.1f} h of bench"
        )
        return answer

    def fit(self, serial: str, model: str, recording: int) -> FitResponse:
        """Fit a model and say how well it does."""
        answer = fit_unit(self.store, serial, FitRequest(recording=recording, model=model), VirtualClock().utc())
        e = answer.error
        floor = "–" if e.noise_floor_dps is None else f"{e.noise_floor_dps:.4f}"
        held = "–" if e.heldout_rms_dps is None else f"{e.heldout_rms_dps:.4f}"
        self.say(
            f"{model}: version {answer.version}; RMS error {e.raw_rms_dps:.4f} -> {e.rms_dps:.4f} deg/s "
            f"(held-out temperatures {held}, noise floor {floor})"
        )
        return answer

    def context(self, recording: int) -> FitData:
        """Return the data sets of a recording."""
        return fit_data_of(self.store.recordings.points(recording))


@contextmanager
def maybe_silent(quiet: bool) -> Iterator[Console]:
    """Yield a console that prints, or one that does not."""
    yield Console(highlight=False, markup=False, quiet=quiet)

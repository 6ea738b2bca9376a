"""The acts that change the database. One process at a time may write, so an act is done here or asked of who holds it.

`open_commands` gives the one that fits: the services of this process, or the running service that holds the database.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, Protocol

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from instruments.bench_config import SERIAL
from labctl.services.schemas.answers import (
    BenchStatus,
    CampaignResponse,
    CertificationResponse,
    FitResponse,
    ImportResponse,
    ScheduledResponse,
)
from procedures.contracts.errors import RecipeError
from procedures.recipe.recipe import shipped_recipes

if TYPE_CHECKING:
    from labctl.services.admin.api_keys import KeyRequest, KeyResponse, NewKeyResponse


class Request(BaseModel):
    """What a person asks for; an unknown key is an error with a name."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class FitRequest(Request):
    """Which model to fit to which recording."""

    recording: int | None = Field(default=None, description="Recording; default: the unit's newest.")
    model: str | None = Field(default=None, description="ojeda2000, yang2018, single_temperature, weiss1995 ...")
    effects: list[str] = Field(
        default_factory=list,
        description="Effect ids, `name:2` sets an order. Without `model` a complete model, with it added to it.",
    )


class ImproveRequest(Request):
    """How to change the effects of a version; the changed model is fitted again and becomes the next version."""

    add: list[str] = Field(default_factory=list, description="Effect ids; `name:2` sets an order.")
    remove: list[str] = Field(default_factory=list, description="Effect ids that are in the version.")
    formula: list[str] = Field(default_factory=list, description="Effects of your own: 'name: expression'.")
    version: int | None = Field(default=None, description="Version to change; default: the newest.")
    recording: int | None = Field(default=None, description="Recording; default: the unit's newest.")


class CertifyRequest(Request):
    """Who makes a version current, and why."""

    by: str = Field(min_length=1)
    reason: str = Field(min_length=1)
    due_days: int | None = Field(default=None, gt=0, le=36_500, description="Days until the unit is due again.")


def never_a_path(recipe: str) -> str:
    """Refuse what would be looked for as a file: a request names a shipped recipe or brings its own text."""
    if "\n" in recipe or recipe in shipped_recipes():
        return recipe
    raise RecipeError(f"no recipe {recipe!r}: send its text, or one of {', '.join(shipped_recipes())}")


RecipeSource = Annotated[
    str, AfterValidator(never_a_path), Field(description="Name of a shipped recipe, or the recipe itself as TOML text.")
]


class CampaignRequest(Request):
    """Which recipe to run on the service's bench."""

    recipe: RecipeSource
    clip: bool = Field(default=False, description="Leave out points that the bench or a unit cannot do.")
    hide: list[str] = Field(
        default_factory=list,
        max_length=20,
        description="Of a simulated bench, now: effects hidden in its units, EFFECT or EFFECT=SIZE in its unit.",
    )
    at: str | None = Field(
        default=None,
        max_length=64,
        description="When to begin, ISO 8601; without offset in `time_zone`. `now`: as soon as the bench is free.",
    )
    cron: str | None = Field(default=None, max_length=200, description="Begin again and again: five fields of cron.")
    time_zone: str | None = Field(
        default=None, max_length=100, description="Of `at` and `cron`, such as Europe/Berlin; default: the local one."
    )
    priority: int = Field(default=0, ge=-100, le=100, description="Of starts that are due, the highest goes first.")
    late_limit_s: float | None = Field(
        default=None,
        ge=0,
        le=1e9,
        description="How much later than due it may begin; 0: a missed start is skipped; absent: any time, once.",
    )


class SimulatedRequest(Request):
    """A recording to be made in simulation, with effects hidden in its unit."""

    recipe: RecipeSource
    hide: list[str] = Field(
        default_factory=list,
        max_length=20,
        description="EFFECT, or EFFECT=SIZE in the catalogue's coefficient unit, or EFFECT=z10: ten noise units.",
    )
    seed: int = Field(default=1, ge=0, lt=1 << 63, description="Same seed, same recording.")
    serial: str | None = Field(default=None, pattern=SERIAL, description="Of the unit; default: the simulated bench's.")
    clip: bool = Field(default=False, description="Leave out points that the bench or the unit cannot do.")


class ExampleRequest(Request):
    """Which of the recordings that come with labctl to take in."""

    name: str = Field(
        max_length=100, description="osu-fog: a real fibre-optic gyro; weiss-gyrostar: a published table."
    )


class PlanRequest(Request):
    """Which recipe to plan on the service's bench."""

    recipe: RecipeSource
    clip: bool = Field(default=False, description="Leave out points that the bench or a unit cannot do.")
    visibility: bool = Field(default=False, description="Also say what the plan could find; it takes some seconds.")


class ReasonRequest(Request):
    """Why something is done to a campaign, or to a key, and by whom."""

    reason: str = Field(min_length=1)
    by: str = Field(default="", max_length=200)

    @property
    def text(self) -> str:
        """Reason and person in one."""
        return f"{self.reason} ({self.by})" if self.by else self.reason


class ConfirmRequest(Request):
    """An answer to the question with this id; an answer to an older question is refused."""

    prompt: str = Field(min_length=1)
    by: str = Field(min_length=1, max_length=200)
    confirmed: bool = Field(default=True, description="False: it cannot be done, and the campaign ends.")
    reason: str = ""


class ResumeRequest(Request):
    """How a campaign that is paused or was interrupted goes on."""

    by: str = Field(default="a person", min_length=1, max_length=200)
    reason: str = ""
    power: Literal["lost", "kept"] | None = Field(
        default=None, description="Whether the units were off meanwhile; absent: yes when the host was."
    )


class ClearRequest(Request):
    """Who has looked at a bench whose safe state was not confirmed."""

    by: str = Field(min_length=1, max_length=200)
    reason: str = "looked at the bench"


class BackupNote(Request):
    """A backup that was made, for the audit trail; nothing is opened by this name."""

    file: str = Field(min_length=1, max_length=255)
    bytes: int = Field(ge=0)
    sha256: str = Field(pattern=r"^[0-9a-f]{64}$")


class Commands(Protocol):
    """Every act that changes the database."""

    def import_recording(self, folder: Path) -> ImportResponse:
        """Take in a recording from a folder in the interchange format; all of it or nothing."""
        ...

    def fit(self, serial: str, request: FitRequest) -> FitResponse:
        """Fit a model and keep it as the unit's next version."""
        ...

    def improve(self, serial: str, request: ImproveRequest) -> FitResponse:
        """Change a version's effects and keep the fit as the unit's next version."""
        ...

    def certify(self, serial: str, version: int, request: CertifyRequest) -> CertificationResponse:
        """Make a version the unit's current one."""
        ...

    def revoke(self, serial: str, version: int, request: CertifyRequest) -> CertificationResponse:
        """Take a version out of force."""
        ...

    def abort_campaign(self, campaign: int, reason: str) -> CampaignResponse:
        """End a campaign now, in the safe state."""
        ...

    def create_key(self, request: KeyRequest) -> NewKeyResponse:
        """Make an API key; the answer is the only place where it is shown."""
        ...

    def revoke_key(self, name: str, reason: str) -> KeyResponse:
        """Take a key's power away."""
        ...

    def note_backup(self, note: BackupNote) -> None:
        """Write down that a backup was made."""
        ...

    def pause_campaign(self, campaign: int, request: ReasonRequest) -> CampaignResponse:
        """Ask a running campaign to hold after the present data set."""
        ...

    def resume_campaign(self, campaign: int, request: ResumeRequest) -> CampaignResponse:
        """Let a paused campaign go on, or take up one that was interrupted."""
        ...

    def confirm(self, campaign: int, request: ConfirmRequest) -> CampaignResponse:
        """Answer the question that a campaign has put. Raises StalePrompt for another one."""
        ...

    def clear_bench(self, bench: str, request: ClearRequest) -> BenchStatus:
        """Take in that a person has looked at a bench that was not confirmed safe."""
        ...

    def schedule_campaign(self, request: CampaignRequest, bench: str | None = None) -> ScheduledResponse:
        """Enter a campaign into the schedule of a bench; a recipe in a file is given by its own text."""
        ...

    def cancel_start(self, start: int) -> ScheduledResponse:
        """Take an entry out of the schedule."""
        ...

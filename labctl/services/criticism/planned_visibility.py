"""A plan with what it could find, of a unit also beside a version's model and the recordings that it was fitted to."""

from __future__ import annotations

from instruments.bench_config import BenchFile
from labctl.answers.plans import PlannedResponse, PlanRequest, Visibility
from labctl.errors import BadInput, NotFound
from labctl.fitting.criticism import schedule_with_planned
from labctl.services.benches.stop_rules import check_stop_on
from labctl.services.cache import UNNAMED, compute
from labctl.services.criticism.evaluation import model_of
from labctl.services.criticism.measurements import Measurements
from labctl.services.criticism.versions import version_of
from labctl.services.planning.plan_answer import LocalStart, Look
from labctl.services.planning.planner import plan_steps
from labctl.services.simulation.visibility import answer_of, visibility
from labctl.services.simulation.walks import walked
from labctl.store import Store
from procedures.planning.plan import Plan


def looking(store: Store | None, serial: str | None, version: int | None) -> Look:
    """Return what says of a plan which effects it could find; with a unit beside the model of its version.

    It is then judged together with the recordings that the version was fitted to; it raises NotFound, BadInput and
    NotEnoughData.
    """
    if serial is None:
        return visibility
    if store is None:
        raise NotFound(f"unit {serial!r} is not in this database; `labctl import DIR` or a campaign adds it")

    def of_unit(plan: Plan, bench: BenchFile) -> list[Visibility]:
        calibration = version_of(store, serial, version)
        numbers = calibration.recordings or (calibration.recording,)
        rows = tuple(store.recordings.get(number) for number in numbers if number is not None)
        if not rows:
            raise BadInput(
                f"version {calibration.version} of {serial} was fitted to no recording of this database; plan without "
                "the unit, or import the recording and fit it"
            )
        measured = Measurements(store, rows).readings
        return answer_of(schedule_with_planned(measured, walked(plan, bench), model_of(calibration)))

    return of_unit


def planned(
    store: Store, request: PlanRequest, bench: BenchFile | None, start: LocalStart | None = None
) -> PlannedResponse:
    """Plan a recipe on a bench, or on the simulated one that fits it best, and say what the plan could find.

    With `start` the answer says when a person is needed.

    Raises RecipeError, PlanRefused, BadInput; with a unit also NotFound.
    """

    def look(plan: Plan, on: BenchFile) -> list[Visibility]:
        compute(UNNAMED)
        return looking(store, request.unit, request.version)(plan, on)

    return plan_steps(store, request, bench, look, start, check_stop_on)

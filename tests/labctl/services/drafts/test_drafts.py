"""The draft that a campaign ends in: fitted, reported on and kept once, whatever interrupts it; never certified."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from instruments.clock import SystemClock, VirtualClock
from labctl.answers.calibrations import FitRequest
from labctl.answers.campaigns import CampaignRequest, StartRequest
from labctl.answers.certification import CertifyRequest
from labctl.answers.drafts import DraftResponse, DraftsRequest
from labctl.errors import BadInput, Conflict
from labctl.services.calibrations.certification import certify, version_in_force
from labctl.services.calibrations.fitting import fit_unit
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.campaigns.execution import run_here
from labctl.services.campaigns.status import campaign_status
from labctl.services.commands.foreground_control import ForegroundControl
from labctl.services.drafts import make, report
from labctl.services.drafts.answers import drafts_of, newest_drafts, with_drafts
from labctl.services.drafts.make import make_drafts
from labctl.services.drafts.watch import TRIES, DraftWatch
from labctl.services.lab_service import LabService
from labctl.services.planning.fit_rules import check_fit
from labctl.services.planning.loading import load_bench
from labctl.services.schedule.queue import add_start, start_status
from labctl.store import Store, open_store
from labctl.store.connection.database import Database
from procedures.contracts.errors import RecipeError
from procedures.recipe.recipe import parse_recipe, shipped_recipes
from tests.helpers.waiting import eventually

NOW = datetime(2026, 11, 1, tzinfo=UTC)
RECIPE = """format = "labctl-recipe/1"
name = "drafted"
temperatures_c = [24, 26, 28]
rates_dps = [-40, -20, 0, 20, 40]
positions = ["z"]
[soak]
hold_s = 120
max_drift_c = 1.0
drift_window_s = 60
[acquire]
duration_s = 10
settle_s = 2
[fit]
effects = ["bias", "scale_factor"]
compare = ["weiss1995", "ojeda2000"]
[fit.limits]
heldout_rms_dps = 1.0
max_error_dps = 1e-9
drift_dps = 0.1
"""
UNIT = "FOG-0001"


@pytest.fixture(scope="module")
def ended(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a database with a campaign that is done and whose draft is due."""
    location = tmp_path_factory.mktemp("drafts") / "lab.sqlite"
    run_here(str(location), StartRequest(recipe=RECIPE, bench="single-axis-sim"))
    return location


@pytest.fixture
def location(ended: Path, tmp_path: Path) -> str:
    for part in ended.parent.iterdir():
        shutil.copy(part, tmp_path)
    return str(tmp_path / ended.name)


@pytest.fixture
def store(location: str) -> Iterator[Store]:
    with open_store(location, write=True) as opened:
        yield opened


@pytest.fixture
def unjudged(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave the verdict out, which takes longest, where a test is about something else."""
    monkeypatch.setattr(report, "_assessed", lambda *_: None)


def made(store: Store, at: datetime = NOW, *, again: bool = False) -> DraftResponse:
    return make_drafts(store, 1, DraftsRequest(again=again), at).drafts[0]


def events(store: Store) -> list[str]:
    return [event.message for event in store.campaigns.events(1) if event.kind == "draft"]


@pytest.mark.slow
def test_a_draft_is_fitted_compared_judged_and_said_once(store: Store) -> None:
    draft = made(store)
    assert (draft.state, draft.version, draft.certified, draft.at) == ("made", 1, False, NOW)
    assert draft.report is not None
    assert [each.model for each in draft.report.compared] == ["custom", "weiss1995", "ojeda2000"]
    assert draft.report.compared[2].error is None
    assert "too little for order 2" in draft.report.compared[2].why
    assert draft.report.verdict in {"adequate", "missing", "ambiguous", "unexplained", "insufficient_data"}
    assert draft.report.as_left is not None
    assert draft.report.as_left.rms_dps == pytest.approx(draft.report.error.rms_dps)
    assert (draft.report.as_found, draft.report.as_found_why) == (None, "no version was in force")
    assert version_in_force(store, UNIT) is None
    again = made(store, NOW + timedelta(hours=1))
    assert again == draft
    assert events(store) == [draft.report.text]
    assert [row.subject for row in store.audit.rows() if row.action == "draft"] == ["campaign 1"]


@pytest.mark.usefixtures("unjudged")
def test_limits_are_held_against_the_figures_and_an_unknown_figure_decides_nothing(store: Store) -> None:
    found = made(store).report
    assert found is not None
    results = {each.limit: each for each in found.limits}
    assert (results["heldout_rms_dps"].passed, results["max_error_dps"].passed) == (True, False)
    assert found.as_left is not None
    assert results["max_error_dps"].value_dps == found.as_left.axes["z"].max_dps
    assert (results["drift_dps"].passed, results["drift_dps"].value_dps) == (None, None)
    assert found.within_limits is False
    assert "largest error of axis z" in found.text
    assert "drift from the version in force" in found.text
    levels = [event.level for event in store.campaigns.events(1) if event.kind == "draft"]
    assert levels == ["warning"]


@pytest.mark.slow
@pytest.mark.usefixtures("unjudged")
def test_the_version_in_force_is_applied_as_it_is_and_the_drift_has_an_uncertainty(store: Store) -> None:
    fit_unit(store, UNIT, FitRequest(effects=["bias", "scale_factor"]), NOW)
    reason = "the first version, for the comparison"
    certify(store, UNIT, 1, CertifyRequest(by="A", reason=reason, override=True), NOW)
    draft = made(store)
    assert draft.version == 2
    found = draft.report
    assert found is not None
    assert found.as_found is not None
    assert found.drift is not None
    assert found.as_found.version == found.drift.version == 1
    assert found.as_found.lines["z"].u_bias_dps > 0
    assert found.drift.largest_dps["z"] == pytest.approx(0.0, abs=1e-12)  # the same recording, the same model
    by_name = {each.coefficient: each for each in found.drift.coefficients}
    assert set(by_name) == {"bias", "scale_factor"}
    assert by_name["bias"].change == 0.0
    assert by_name["bias"].u is not None
    assert by_name["bias"].u > 0
    assert by_name["bias"].significant is False
    assert {each.limit: each.passed for each in found.limits}["drift_dps"] is True
    assert version_in_force(store, UNIT) == 1


@pytest.mark.slow
@pytest.mark.usefixtures("unjudged")
def test_another_model_in_force_is_compared_by_its_corrected_rates_alone(store: Store) -> None:
    fit_unit(store, UNIT, FitRequest(effects=["bias"]), NOW)
    certify(store, UNIT, 1, CertifyRequest(by="A", reason="the bias alone, to compare", override=True), NOW)
    found = made(store).report
    assert found is not None
    assert found.drift is not None
    assert found.drift.coefficients == []
    assert "another model" in found.drift.why
    assert found.drift.largest_dps["z"] > 0.1
    assert {each.limit: each.passed for each in found.limits}["drift_dps"] is False


@pytest.mark.usefixtures("unjudged")
def test_what_was_interrupted_between_fit_and_report_is_reported_on_the_same_version(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    def killed(*_: object) -> None:
        raise SystemExit

    with monkeypatch.context() as patched:
        patched.setattr(make, "report_on", killed)
        with pytest.raises(SystemExit):
            made(store)
    assert [(each.state, each.version) for each in drafts_of(store, 1)] == [("fitted", 1)]
    assert store.drafts.outstanding() == [1]
    draft = made(store)
    assert (draft.state, draft.version) == ("made", 1)
    assert store.calibrations.versions(UNIT) == [1]
    assert len(events(store)) == 1


@pytest.mark.usefixtures("unjudged")
def test_a_draft_that_another_process_made_meanwhile_is_not_kept_again(store: Store) -> None:
    made(store)
    with pytest.raises(Conflict, match="another process has made the draft"):
        fit_unit(store, UNIT, FitRequest(effects=["bias"]), NOW, is_draft=True)
    assert store.calibrations.versions(UNIT) == [1]


@pytest.mark.usefixtures("unjudged")
def test_data_that_cannot_be_fitted_leave_the_campaign_done_and_say_what_to_do(store: Store) -> None:
    rules = store.campaigns.get(1).recipe["fit"]
    assert isinstance(rules, dict)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(make, "fit_unit", _refusing)
        failed = made(store)
    assert (failed.state, failed.version) == ("failed", None)
    assert "the output of axis z does not move; inspect recording 1, then `labctl fit FOG-0001" in failed.reason
    assert "--effects bias,scale_factor`" in failed.reason
    assert events(store) == [failed.reason]
    assert store.campaigns.get(1).state == "done"
    assert store.drafts.outstanding() == []
    assert made(store).state == "failed"  # only on demand again
    assert made(store, again=True).state == "made"


def _refusing(*_: object, **__: object) -> None:
    raise BadInput("the output of axis z does not move")


def test_a_computation_that_never_ends_well_becomes_the_reason_after_some_tries(store: Store) -> None:
    tried: list[int] = []

    def ends(campaign: int) -> None:
        tried.append(campaign)
        raise RuntimeError("out of memory")

    watch = DraftWatch(store, VirtualClock(NOW), lambda: "single-axis-sim", ends)
    for _ in range(TRIES + 2):
        watch.tick()
    assert tried == [1] * TRIES
    assert "RuntimeError: out of memory" in drafts_of(store, 1)[0].reason


def test_only_campaigns_of_the_own_bench_are_watched(store: Store) -> None:
    tried: list[int] = []
    DraftWatch(store, VirtualClock(NOW), lambda: "another", tried.append).tick()
    assert tried == []
    DraftWatch(store, VirtualClock(NOW), lambda: None, tried.append).tick()
    assert tried == [1]


@pytest.mark.usefixtures("unjudged")
def test_a_service_makes_what_the_last_one_left(location: str) -> None:
    with open_store(location, write=True) as store:
        service = LabService(store, VirtualClock(NOW))
        service.start()
        try:
            eventually(lambda: not store.drafts.is_awaited(1))
            assert service.status(1).drafts[0].state == "made"
            draft = newest_drafts(store, [UNIT])[UNIT]
            assert draft.version == 1
            row = next(row for row in store.audit.rows() if row.action == "draft")
            assert row.who == "labctl"
        finally:
            service.close()


@pytest.mark.usefixtures("unjudged")
def test_a_campaign_in_a_terminal_makes_its_draft_after_the_bench_is_closed(location: str) -> None:
    control = ForegroundControl(location)
    with open_store(location, write=False) as store:
        answer = with_drafts(store, campaign_status(store, 1))
    assert [each.state for each in answer.drafts] == ["due"]
    assert [each.state for each in control._with_drafts(answer).drafts] == ["made"]


@pytest.mark.slow
def test_a_campaign_without_fit_ends_in_its_recordings(tmp_path: Path) -> None:
    location = str(tmp_path / "lab.sqlite")
    run_here(location, StartRequest(recipe=RECIPE, bench="single-axis-sim", fit=False))
    with open_store(location, write=False) as store:
        assert store.drafts.outstanding() == []
        assert store.campaigns.get(1).recipe["fit"] is None


@pytest.fixture
def scheduled(tmp_path: Path) -> Iterator[Callable[[CampaignRequest], LabService]]:
    opened: list[LabService] = []

    def begin(request: CampaignRequest) -> LabService:
        bench = load_bench("single-axis-sim")
        store = Store(Database(str(tmp_path / "lab.sqlite"), write=True))  # which the service closes
        add_start(store, request, bench, NOW)
        service = LabService(store, SystemClock(), BenchRunner(store, bench, lambda: VirtualClock(NOW)))
        opened.append(service)
        service.start()
        return service

    yield begin
    for service in opened:
        service.close()


@pytest.mark.slow
@pytest.mark.usefixtures("unjudged")
def test_a_scheduled_campaign_with_hidden_effects_ends_in_a_draft(
    scheduled: Callable[[CampaignRequest], LabService],
) -> None:
    request = CampaignRequest(recipe=RECIPE, at="now", hide=["bias=0.3"])
    service = scheduled(request)
    eventually(lambda: any(each.state == "made" for each in drafts_of(service.store, 1)))
    entry = start_status(service.store, 1)
    assert (entry.hide, entry.fit) == (["bias=0.3"], True)
    row = service.store.campaigns.get(1)
    simulation = row.bench["simulation"]
    assert isinstance(simulation, dict)
    assert simulation["hidden"] == {"bias": 0.3}


def test_hidden_effects_of_a_later_start_are_checked_when_it_is_entered(store: Store) -> None:
    bench = load_bench("single-axis-sim")
    with pytest.raises(BadInput, match="effect 'nothing' cannot be hidden"):
        add_start(store, CampaignRequest(recipe=RECIPE, at="now", hide=["nothing"]), bench, NOW)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (('effects = ["bias", "scale_factor"]', ""), "name a model"),
        (("[fit.limits]", "against = false\n[fit.limits]"), "drift_dps compares with the version in force"),
        (("drift_dps = 0.1", "drift_dps = -1"), "greater than 0"),
        (("compare", "compere"), "did you mean 'compare'"),
    ],
)
def test_a_fit_that_cannot_be_made_is_refused_with_the_recipe(change: tuple[str, str], said: str) -> None:
    with pytest.raises(RecipeError, match=said):
        parse_recipe(RECIPE.replace(*change))


@pytest.mark.parametrize("change", [('"weiss1995"', '"weis1995"'), ('"bias",', '"bais",')])
def test_names_that_are_not_known_are_refused_before_a_campaign_begins(change: tuple[str, str]) -> None:
    with pytest.raises(BadInput, match=r"recipe drafted: \[fit\]: .*(weis1995|bais)"):
        check_fit(parse_recipe(RECIPE.replace(*change)))


def test_every_shipped_fit_names_known_models() -> None:
    fitted = [name for name, path in shipped_recipes().items() if "[fit]" in path.read_text(encoding="utf-8")]
    assert {"ojeda2000", "table1-x-table2", "yang-23-rates", "gyrostar"} <= set(fitted)
    for name in fitted:
        check_fit(parse_recipe(shipped_recipes()[name].read_text(encoding="utf-8")))

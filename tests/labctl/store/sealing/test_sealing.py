"""Every way in which a record ends leaves a manifest, and what changes it in order leaves another one."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import closing, suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sqlalchemy as sa
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from instruments.clock import VirtualClock
from instruments.errors import NoReply
from labctl.answers.calibrations import FitRequest
from labctl.answers.campaigns import ResumeRequest
from labctl.errors import Conflict, LabctlError
from labctl.recording import Recording
from labctl.services.calibrations.fitting import fit_unit
from labctl.services.campaigns.execution import run
from labctl.services.campaigns.preparation import Prepared, prepare
from labctl.services.campaigns.resume import prepare_resume
from labctl.services.planning.loading import load_bench
from labctl.store import DraftEvent, Store, check, copy_database, open_store
from labctl.store.connection.database import Database
from labctl.store.manifests.digests import digest_of_rows
from labctl.store.manifests.parts import differing
from labctl.store.schema import tables
from procedures.contracts.campaign_state import CampaignState
from procedures.contracts.control import Control
from procedures.contracts.journal import DataSetState, Event
from tests.helpers import certificates

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)


@pytest.fixture
def location(tmp_path: Path) -> str:
    return str(tmp_path / "lab.sqlite")


def acts(location: str, kind: str) -> list[tuple[str, str]]:
    """Return what was done to the records of a kind, in order, with the reason."""
    m = tables.manifests.c
    with closing(Database(location, write=False)) as database, database.reading() as connection:
        rows = connection.execute(sa.select(m.act, m.document).where(m.kind == kind).order_by(m.sequence)).all()
    return [(row.act, json.loads(row.document)["reason"]) for row in rows]


def prepared(store: Store) -> Prepared:
    return prepare(store, "short", load_bench("single-axis-sim"), VirtualClock(), clip=False)


def ended_at(store: Store, text: str, act: Callable[[Prepared, Control], None]) -> int:
    """Run `short` and do something once a step whose text holds `text` runs; returns the campaign."""
    campaign, control = prepared(store), Control()

    def seen(progress: Any) -> None:
        if text in progress.step_text and progress.state == "running":
            act(campaign, control)

    run(store, campaign, control, seen)
    return campaign.id


def break_table(campaign: Prepared, _control: Control) -> None:
    def fail(*_: Any) -> None:
        raise NoReply("table", "no answer")

    table: Any = campaign.bench.table
    table.spin = fail


def abort(_campaign: Prepared, control: Control) -> None:
    control.abort("enough")


@pytest.mark.slow
@pytest.mark.parametrize(("act", "state"), [(abort, "aborted"), (break_table, "failed")], ids=["aborted", "failed"])
def test_a_campaign_that_ends_early_is_sealed_reopened_and_sealed(
    location: str, act: Callable[[Prepared, Control], None], state: str
) -> None:
    with open_store(location, write=True) as store:
        campaign = ended_at(store, "data set 4 of", act)
        assert store.campaigns.state(campaign) == state
        assert check(location).findings == ()
        bench = load_bench("single-axis-sim")
        request = ResumeRequest(by="Ada")
        again = prepare_resume(store, campaign, bench, lambda s: VirtualClock(s.last_at), request)
        assert (check(location).findings, check(location).not_sealed) == ((), 2)
        assert run(store, again).state == "done"
    found = check(location)
    assert (found.findings, found.not_sealed) == ((), 0)
    for kind in ("campaign", "recording"):
        (first, reopened, last) = acts(location, kind)
        assert (first, last) == (("sealed", state), ("sealed", "done"))
        assert reopened[0] == "reopened"
        assert "resumed: " in reopened[1]


def test_a_campaign_that_is_not_over_is_not_sealed_and_said(location: str) -> None:
    with open_store(location, write=True) as store:
        prepared(store).bench.close()
        found = check(location)
        assert (found.findings, found.not_sealed) == ((), 2)
        assert found.manifests == 1  # of the audit trail
        store.campaigns.close_unfinished(1, "its process was killed", AT, CampaignState.ABORTED)
    found = check(location)
    assert (found.findings, found.not_sealed) == ((), 0)
    assert acts(location, "recording") == [("sealed", "aborted")]


@pytest.mark.slow
def test_what_a_journal_writes_after_the_end_is_sealed_again(location: str) -> None:
    with open_store(location, write=True) as store:
        campaign = prepared(store)
        run(store, campaign)
        journal = store.campaigns.journal(campaign.id)
        journal.dataset_closed(3, DataSetState.PARTIAL, "the table was touched")
        journal.event(Event("note", "found afterwards"), 1.0, AT)
    assert check(location).findings == ()
    assert acts(location, "recording")[1:] == [("sealed", "written after the end")] * 2


@pytest.mark.slow
def test_a_draft_is_an_event_after_the_end(location: str) -> None:
    with open_store(location, write=True) as store:
        campaign = prepared(store)
        run(store, campaign)
        recording = store.recordings.all()[0].id
        with store._database.writing() as connection:
            row = {"recording_id": recording, "campaign_id": campaign.id, "serial": "FOG-0001", "state": "due"}
            connection.execute(sa.insert(tables.drafts).values(**row))
        assert store.drafts.fail(recording, "no", DraftEvent("no draft", "warning"), AT)
    assert check(location).findings == ()
    assert acts(location, "campaign") == [("sealed", "done"), ("sealed", "draft")]


@pytest.mark.slow
def test_calibrations_certifications_certificates_and_keys_are_sealed(location: str) -> None:
    with open_store(location, write=True) as store:
        version = certificates.add_version(store)
        store.calibrations.certify(certificates.SERIAL, version, "revoke", by="A", reason="dropped", at=AT)
        store.calibrations.certify(certificates.SERIAL, version, "certify", by="A", reason="it is well", at=AT)
        certificates.issue(store, certificates.SERIAL, version, certificates.request(), certificates.AT)
        store.keys.add("A", "viewer", "0" * 64, AT)
        store.keys.revoke("A", "gone", AT)
    assert check(location).findings == ()
    assert [act for act, _ in acts(location, "certification")] == ["sealed"] * 3
    assert acts(location, "certificate") == [("sealed", "issued")]
    assert acts(location, "key") == [("sealed", "made"), ("sealed", "revoked")]
    assert acts(location, "calibration") == [("sealed", "fit")]


def test_a_record_that_was_sealed_before_a_part_existed_had_nothing_of_it() -> None:
    nothing = digest_of_rows(()).as_json()
    marks, head = {"rows": 1, "digest": "ab"}, {"head": {"rows": 1, "digest": "cd"}}
    assert differing(head, {**head, "verification marks": nothing}) == []
    assert differing(head, {**head, "verification marks": marks}) == ["verification marks"]
    assert differing({**head, "verification marks": marks}, {**head, "verification marks": marks}) == []


def test_a_transaction_that_fails_leaves_no_manifest(location: str) -> None:
    with open_store(location, write=True) as store:
        store.keys.add("A", "viewer", "0" * 64, AT)
        with pytest.raises(Conflict):
            store.keys.add("A", "viewer", "1" * 64, AT)
    assert (check(location).manifests, check(location).findings) == (1, ())


def test_a_backup_elsewhere_has_no_anchor_file_and_fits_the_anchor_that_it_printed(
    location: str, tmp_path: Path
) -> None:
    with open_store(location, write=True) as store:
        store.keys.add("A", "viewer", "0" * 64, AT)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    copy_database(location, elsewhere / "copy.sqlite")
    head = check(location).head
    found = check(str(elsewhere / "copy.sqlite"), chain_anchor=head)
    assert found.findings == ()
    assert "there is no anchor file" in found.remarks[0]
    with open_store(str(elsewhere / "copy.sqlite"), write=True) as store:
        store.keys.add("B", "viewer", "1" * 64, AT)
    assert check(str(elsewhere / "copy.sqlite"), chain_anchor=head).remarks == ()


class _Laboratory:
    """Does what a laboratory does, in any order; what is refused is refused."""

    def __init__(self, store: Store) -> None:
        self.store = store
        self.keys = 0

    def campaign(self) -> None:
        run(self.store, prepared(self.store))

    def aborted(self) -> None:
        ended_at(self.store, "data set 2 of", abort)

    def planned(self) -> None:
        prepared(self.store).bench.close()

    def resumed(self) -> None:
        number = self.store.campaigns.newest().id
        bench = load_bench("single-axis-sim")
        again = prepare_resume(self.store, number, bench, lambda s: VirtualClock(s.last_at), ResumeRequest(by="A"))
        run(self.store, again)

    def closed(self) -> None:
        for row in self.store.campaigns.unfinished():
            self.store.campaigns.close_unfinished(row.id, "killed", AT)

    def imported(self) -> None:
        self.store.recordings.add_import(certificates.simulated(), AT)

    def spoilt_import(self) -> None:
        good = certificates.simulated()
        columns = {**good.columns, "dataset": np.zeros(len(good), dtype=np.int64)}
        self.store.recordings.add_import(Recording(good.info, columns, None), AT)

    def fitted(self) -> None:
        fit_unit(self.store, certificates.SERIAL, FitRequest(effects=["bias", "scale_factor"]), AT)

    def certified(self) -> None:
        self.store.calibrations.certify(certificates.SERIAL, 1, "certify", by="A", reason="it is well", at=AT)

    def revoked(self) -> None:
        self.store.calibrations.certify(certificates.SERIAL, 1, "revoke", by="A", reason="dropped", at=AT)

    def key(self) -> None:
        self.keys += 1
        self.store.keys.add(f"key {self.keys}", "viewer", f"{self.keys:064d}", AT)

    def key_revoked(self) -> None:
        self.store.keys.revoke(f"key {self.keys}", "gone", AT)

    def withdrawn(self) -> None:
        self.store.campaigns.journal(1).dataset_closed(2, DataSetState.PARTIAL, "withdrawn")


OPERATIONS = [name for name in vars(_Laboratory) if not name.startswith("_")]


@pytest.mark.slow
@settings(max_examples=12, deadline=None, suppress_health_check=list(HealthCheck))
@given(st.lists(st.sampled_from(OPERATIONS), min_size=1, max_size=8))
def test_no_order_of_acts_in_order_gives_a_finding(
    tmp_path_factory: pytest.TempPathFactory, operations: list[str]
) -> None:
    location = str(tmp_path_factory.mktemp("any") / "lab.sqlite")
    with open_store(location, write=True) as store:
        laboratory = _Laboratory(store)
        for name in operations:
            with suppress(LabctlError, ValueError, sa.exc.IntegrityError):
                getattr(laboratory, name)()
    found = check(location)
    assert found.findings == (), operations

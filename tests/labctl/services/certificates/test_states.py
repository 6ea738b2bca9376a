"""The life of a certificate: issued, amended, superseded, withdrawn; each state on list, file, address and check."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from datetime import timedelta
from pathlib import Path

import pytest
import sqlalchemy as sa
from alembic import command

from labctl.acting_user import Actor, acting
from labctl.answers.certificates import CertificateRequest, WithdrawRequest
from labctl.answers.certification import RevokeRequest
from labctl.cli.printing.certificates import state_text
from labctl.errors import Conflict, NotFound
from labctl.services.calibrations.certification import revoke
from labctl.services.calibrations.served import calibration_file
from labctl.services.certificates.address import HASH_DIGITS
from labctl.services.certificates.issue import CertificateRefused, issue, withdraw
from labctl.services.certificates.served import certificate_file, public_certificate
from labctl.services.certificates.states import certificate_by_number, list_certificates
from labctl.store import Store, check, copy_database, migrate, migrate_database, open_store
from labctl.withdrawal import HEADER, Withdrawn, read_withdrawn
from tests.helpers.certificates import AT, SERIAL, add_version, request

DAY = timedelta(days=1)


@pytest.fixture(scope="module")
def with_versions(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("certificates") / "lab.sqlite"
    with open_store(str(path), write=True) as opened:
        add_version(opened)
        add_version(opened, certified=False)
        issue(opened, SERIAL, 1, request(), AT)
    return path


@pytest.fixture
def store(with_versions: Path, tmp_path: Path) -> Iterator[Store]:
    """Return a store with two versions; the first is certified and has certificate ICL-2027-0001."""
    copy_database(str(with_versions), tmp_path / "lab.sqlite")
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as opened:
        yield opened


FIRST, SECOND, THIRD = "ICL-2027-0001", "ICL-2027-0002", "ICL-2027-0003"


def states(store: Store) -> dict[str, str]:
    return {row.number: row.state for row in list_certificates(store, SERIAL)}


def certify(store: Store, version: int, days: float) -> None:
    store.calibrations.certify(SERIAL, version, "certify", by="Ada", reason="again", at=AT + days * DAY)


def amend(store: Store, days: float) -> str:
    asked = CertificateRequest(by="I. Issuer", amend="street was wrong")
    return issue(store, SERIAL, 1, asked, AT + days * DAY).number


def test_from_valid_over_amended_and_superseded_to_withdrawn(store: Store) -> None:
    assert states(store) == {FIRST: "valid"}
    assert amend(store, 1) == SECOND
    first = certificate_by_number(store, FIRST)
    assert (first.state, first.replaced_by, first.superseded_by) == ("amended", SECOND, None)
    assert (first.state_reason, first.state_since, first.valid_instead) == ("street was wrong", AT + DAY, SECOND)

    certify(store, 2, 2)
    assert states(store) == {FIRST: "amended", SECOND: "valid"}  # version 2 has no certificate yet
    issue(store, SERIAL, 2, request(), AT + 3 * DAY)
    assert states(store) == {FIRST: "amended", SECOND: "superseded", THIRD: "valid"}
    second = certificate_by_number(store, SECOND)
    assert (second.superseded_by, second.replaced_by, second.state_since) == (THIRD, None, AT + 3 * DAY)
    assert second.state_reason == f"version 2 of the unit was certified, and has certificate {THIRD}"
    assert certificate_by_number(store, FIRST).valid_instead == THIRD

    revoke(store, SERIAL, 2, RevokeRequest(by="Rita", reason="was dropped"), AT + 4 * DAY)
    assert states(store) == {FIRST: "amended", SECOND: "superseded", THIRD: "withdrawn"}  # none comes back by itself
    third = certificate_by_number(store, THIRD)
    assert (third.state_reason, third.state_by, third.state_since) == ("was dropped", "Rita", AT + 4 * DAY)
    assert third.valid_instead is None
    second = certificate_by_number(store, SECOND)
    assert (second.superseded_by, second.valid_instead, second.state_since) == (None, None, AT + 3 * DAY)
    assert second.state_reason.endswith(f"was certified, and has certificate {THIRD}, which was withdrawn")
    assert "X-Labctl-Replaced-By" not in certificate_file(store, SERIAL, 1, "pdf", SECOND).headers()
    assert state_text(second).endswith(f"{THIRD}, which was withdrawn); none is valid instead")

    certify(store, 1, 5)  # a rollback
    assert states(store) == {FIRST: "amended", SECOND: "valid", THIRD: "withdrawn"}
    assert certificate_by_number(store, THIRD).superseded_by == SECOND
    certify(store, 2, 6)
    assert states(store)[THIRD] == "withdrawn"  # for good


def test_an_amended_certificate_says_that_the_one_in_its_place_was_withdrawn(store: Store) -> None:
    amend(store, 1)
    withdraw(store, WithdrawRequest(number=SECOND, by="Rita", reason="wrong item"), AT + 2 * DAY)
    first = certificate_by_number(store, FIRST)
    assert (first.state, first.replaced_by, first.valid_instead) == ("amended", SECOND, None)
    assert first.state_reason == f"street was wrong; certificate {SECOND}, which replaces it, was withdrawn"
    third = amend(store, 3)
    assert certificate_by_number(store, FIRST).valid_instead == third
    assert certificate_file(store, SERIAL, 1, "pdf", FIRST).headers()["X-Labctl-Replaced-By"] == third


def test_a_revocation_withdraws_every_certificate_of_the_version_and_of_no_other(store: Store) -> None:
    amend(store, 1)
    certify(store, 2, 2)
    issue(store, SERIAL, 2, request(), AT + 3 * DAY)
    certify(store, 1, 4)
    revoke(store, SERIAL, 1, RevokeRequest(by="Rita", reason="was dropped"), AT + 5 * DAY)
    assert states(store) == {FIRST: "withdrawn", SECOND: "withdrawn", THIRD: "superseded"}
    rows = [row for row in store.audit.rows() if row.action == "certificate withdraw"]
    assert [row.detail["number"] for row in rows] == [FIRST, SECOND]
    assert {row.who for row in rows} == {"Rita"}


def test_a_certificate_that_is_issued_while_its_version_is_revoked_is_withdrawn(store: Store) -> None:
    """The revocation finds no row to withdraw yet: the state follows from the act."""
    number = issue(store, SERIAL, 1, request(), AT).number
    row = store.certificates.get(number)
    forms = store.certificates.forms(number)
    revoke(store, SERIAL, 1, RevokeRequest(by="Rita", reason="was dropped"), AT + timedelta(days=1))
    late = replace(row, number="ICL-2099-0001", replaces=number, withdrawal=None)
    store.certificates.add(late, forms)
    state = {each.number: each for each in list_certificates(store, SERIAL)}["ICL-2099-0001"]
    assert (state.state, state.state_reason, state.state_by) == ("withdrawn", "was dropped", "Rita")


def test_the_file_says_its_state_beside_its_bytes_which_stay(store: Store) -> None:
    before = certificate_file(store, SERIAL, 1, "pdf")
    assert before.headers()["X-Labctl-State"] == "valid"
    assert HEADER not in before.headers()
    withdraw(store, WithdrawRequest(number=FIRST, by="Rita", reason='a "standard" was bad'), AT + DAY)
    after = certificate_file(store, SERIAL, 1, "pdf")
    assert (after.content, after.etag) == (before.content, before.etag)
    headers = after.headers()
    assert headers["X-Labctl-State"] == "withdrawn"
    assert read_withdrawn(headers[HEADER]) == Withdrawn(AT + DAY, "Rita", 'a "standard" was bad', FIRST)
    amended = amend(store, 2)
    assert certificate_file(store, SERIAL, 1, "pdf", FIRST).headers()["X-Labctl-Replaced-By"] == amended
    assert states(store) == {FIRST: "withdrawn", amended: "valid"}


def test_who_fetches_the_calibration_is_told_until_the_version_is_certified_again(store: Store) -> None:
    def notice(version: int | None = 1, form: str = "json") -> str | None:
        return calibration_file(store, SERIAL, version, form).headers(AT).get(HEADER)

    assert notice() is None
    withdraw(store, WithdrawRequest(number=FIRST, by="Rita", reason="standard was bad"), AT + DAY)
    for version, form in ((1, "json"), (None, "json"), (1, "c")):
        found = notice(version, form)
        assert found is not None
        assert read_withdrawn(found) == Withdrawn(AT + DAY, "Rita", "standard was bad", FIRST)
    assert notice(2) is None  # another version
    certify(store, 1, 2)
    assert notice() is None
    revoke(store, SERIAL, 1, RevokeRequest(by="Rita", reason="was dropped"), AT + 3 * DAY)
    found = notice()
    assert found is not None
    assert read_withdrawn(found) == Withdrawn(AT + 3 * DAY, "Rita", "was dropped")
    assert notice(1, "c") == found


def test_a_new_certificate_in_place_of_a_withdrawn_one_needs_a_reason(store: Store) -> None:
    withdraw(store, WithdrawRequest(number=FIRST, by="Rita", reason="standard was bad"), AT + DAY)
    assert issue(store, SERIAL, 1, CertificateRequest(by="I. Issuer"), AT).state == "withdrawn"  # a copy
    with pytest.raises(
        CertificateRefused, match=rf"{FIRST} .* was withdrawn at .* by Rita \(standard was bad\).*amend"
    ):
        issue(store, SERIAL, 1, request(), AT + 2 * DAY)
    with pytest.raises(Conflict, match="is withdrawn already"):
        withdraw(store, WithdrawRequest(number=FIRST, by="Rita", reason="again"), AT + 2 * DAY)
    with pytest.raises(NotFound, match="no certificate 'X-1'"):
        withdraw(store, WithdrawRequest(number="X-1", by="Rita", reason="again"), AT + 2 * DAY)


def test_the_public_state_is_told_to_those_who_know_what_the_paper_says(store: Store) -> None:
    hash_ = store.calibrations.get(SERIAL, 1).hash
    found = public_certificate(store, FIRST, hash_[:HASH_DIGITS].upper())
    assert (found.number, found.calibration_hash, found.state) == (FIRST, hash_, "valid")
    assert found.laboratory == "Inertial Laboratory & Sons"
    for number, given in ((FIRST, hash_[: HASH_DIGITS - 1]), (FIRST, "0" * 64), (SECOND, hash_), (FIRST, "")):
        with pytest.raises(NotFound, match="compare both with the paper"):
            public_certificate(store, number, given)


def test_the_keys_identity_stands_beside_the_name(store: Store) -> None:
    with acting(Actor("rita-key", "key")):
        answer = withdraw(store, WithdrawRequest(number=FIRST, by="Rita", reason="standard was bad"), AT + DAY)
    assert (answer.state_by, answer.state_by_key) == ("Rita", "rita-key")
    with acting(Actor("root", "command line")):
        assert issue(store, SERIAL, 1, CertificateRequest(by="Ida", amend="new"), AT + DAY).by_key is None


def checked(store: Store, *statements: str) -> list[str]:
    location = store.location
    store.close()
    with closing(sqlite3.connect(location)) as raw:
        for each in statements:
            raw.execute(each)
        raw.commit()
    return [finding.text for finding in check(location).findings]


def test_the_check_notices_a_withdrawal_that_was_deleted(store: Store) -> None:
    withdraw(store, WithdrawRequest(number=FIRST, by="Rita", reason="standard was bad"), AT + DAY)
    (found,) = checked(store, "DELETE FROM certificate_withdrawals")
    assert f"withdrawal of certificate {FIRST} is missing: it was sealed on 2027-03-02" in found


def test_the_check_notices_a_withdrawal_and_a_key_that_were_changed(store: Store) -> None:
    revoke(store, SERIAL, 1, RevokeRequest(by="Rita", reason="was dropped"), AT + DAY)
    found = checked(
        store, "UPDATE certificate_withdrawals SET reason = 'no matter'", "UPDATE certifications SET by_key = 'boss'"
    )
    assert any(f"withdrawal of certificate {FIRST}: head changed" in text for text in found)
    assert any("persons changed" in text for text in found)


def test_a_migration_withdraws_the_certificates_of_versions_that_were_revoked(store: Store) -> None:
    """A database of schema 0017 knew no withdrawals: a certificate of a revoked version passed for a valid one."""
    location = store.location
    revoke(store, SERIAL, 1, RevokeRequest(by="Rita", reason="was dropped"), AT + DAY)
    certify(store, 1, 2)
    asked = request().model_copy(update={"amend": "issued again"})
    assert issue(store, SERIAL, 1, asked, AT + 3 * DAY).number == SECOND
    with store.calibrations._database.writing() as connection:
        command.downgrade(migrate.configuration(connection), "0017")
        manifests = sa.table("manifests", sa.column("kind"), sa.column("sequence"))
        connection.execute(sa.delete(manifests).where(manifests.c.kind == "withdrawal"))  # 0017 never made one
    store.close()
    migrate_database(location, copy=False)
    with open_store(location, write=True) as migrated:
        assert states(migrated) == {FIRST: "withdrawn", SECOND: "valid"}
        first = certificate_by_number(migrated, FIRST)
        assert (first.state_reason, first.state_by, first.state_since) == ("was dropped", "Rita", AT + DAY)
        assert calibration_file(migrated, SERIAL, 1, "json").withdrawn is None  # it was certified again

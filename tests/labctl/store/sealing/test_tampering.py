"""Whatever is changed by hand is found and named: with a key and without one, in a file and on a server."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

import pytest

from instruments.clock import VirtualClock
from labctl.answers.admin import KeyRequest, Role
from labctl.answers.calibrations import FitRequest
from labctl.services.admin.seal_keys import create_seal_key
from labctl.services.campaigns.execution import run
from labctl.services.campaigns.preparation import prepare
from labctl.services.commands.registry import CREATE_KEY, FIT, IMPORT_RECORDING
from labctl.services.commands.requests import RecordingFolder, ToUnit
from labctl.services.planning.loading import load_bench
from labctl.store import Checked, PublicKey, check, open_store, read_public_key
from labctl.store.connection.anchor_file import anchor_path, write_anchor
from tests.helpers.certifying import REASON
from tests.helpers.commands import local_executor
from tests.helpers.paths import EXAMPLES
from tests.helpers.tampering import EDITS, by_hand, write_chain_anew

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)
MANIFESTS = 8  #: of the laboratory below; the start of its campaign is a row of the audit trail alone


def fill(location: str) -> None:
    """Keep a campaign's readings, an import, a calibration in force and two API keys."""
    clock = VirtualClock()
    with open_store(location, write=True) as store:
        run(store, prepare(store, "short", load_bench("single-axis-sim"), clock, clip=False))
        commands = local_executor(store, clock)
        commands.execute(IMPORT_RECORDING, RecordingFolder(EXAMPLES / "osu-fog"))
        commands.execute(FIT, ToUnit("OSU-FOG-2024", FitRequest(effects=["bias", "scale_factor"])))
        store.calibrations.certify("OSU-FOG-2024", 1, "certify", by="A", reason=REASON, at=AT)
        commands.execute(CREATE_KEY, KeyRequest(name="guest", role=Role.VIEWER))
        commands.execute(CREATE_KEY, KeyRequest(name="head", role=Role.APPROVER))


@pytest.fixture(scope="module")
def keyed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A folder with a database whose manifests are signed, and the public key."""
    folder = tmp_path_factory.mktemp("keyed")
    create_seal_key(folder / "seal.pem")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("LABCTL_SEAL_KEY", str(folder / "seal.pem"))
        fill(str(folder / "lab.sqlite"))
    return folder


@pytest.fixture
def location(keyed: Path, tmp_path: Path) -> str:
    for file in keyed.glob("lab.sqlite*"):
        shutil.copy(file, tmp_path / file.name)
    return str(tmp_path / "lab.sqlite")


@pytest.fixture(scope="module")
def key(keyed: Path) -> PublicKey:
    return read_public_key(keyed / "seal.pem.pub")


def says(found: Checked, part: str, words: str) -> bool:
    return any(each.part == part and words in each.text for each in found.findings)


def test_nothing_is_found_where_nothing_was_changed(location: str, key: PublicKey) -> None:
    for keys in ([], [key]):
        found = check(location, keys=keys)
        assert found.findings == ()
        assert found.remarks == ()
        assert (found.signed, found.not_sealed) == (found.manifests, 0)
        assert found.keys == (key.fingerprint,)
        assert found.manifests >= MANIFESTS


@pytest.mark.parametrize("with_key", [False, True], ids=["without key", "with key"])
@pytest.mark.parametrize("name", EDITS)
def test_an_edit_is_found_and_named(location: str, key: PublicKey, name: str, with_key: bool) -> None:
    edit, part, words = EDITS[name]
    with by_hand(location) as connection:
        edit(connection)
    anchor_path(location).unlink()  # the chain alone is enough
    found = check(location, keys=[key] if with_key else [])
    assert says(found, part, words), found.findings


@pytest.mark.slow
@pytest.mark.parametrize("how", ["key", "anchor file", "given anchor"])
@pytest.mark.parametrize("name", EDITS)
def test_an_edit_whose_author_made_all_fit_again_is_found(location: str, key: PublicKey, name: str, how: str) -> None:
    head = check(location).head
    with by_hand(location) as connection:
        EDITS[name][0](connection)
        write_chain_anew(connection)
    if how != "anchor file":
        anchor_path(location).unlink()
    assert not any(each.part == "manifests" for each in check(location).findings) or how == "anchor file"
    found = check(location, keys=[key] if how == "key" else [], chain_anchor=head if how == "given anchor" else None)
    assert says(found, "manifests", "signature does not fit" if how == "key" else "the chain was rewritten")


def test_without_key_and_anchor_such_an_edit_is_not_found_which_is_said(location: str) -> None:
    with by_hand(location) as connection:
        EDITS["rates"][0](connection)
        write_chain_anew(connection)
    anchor_path(location).unlink()
    found = check(location)
    assert found.findings == ()
    assert any("there is no anchor file" in remark for remark in found.remarks)


@pytest.mark.parametrize(
    ("statement", "says_so"),
    [
        ("DELETE FROM manifests WHERE sequence = 3", "manifests before manifest 4 are missing"),
        (
            "DELETE FROM manifests WHERE sequence = (SELECT max(sequence) FROM manifests)",
            "last 1 manifests are missing",
        ),
        (
            "UPDATE manifests SET document = replace(document, 'sealed', 'closed') WHERE sequence = 3",
            "manifest 3 was ch",
        ),
        ("UPDATE manifests SET record = '7' WHERE kind = 'recording' AND sequence < 4", "given to another record"),
        ("DELETE FROM manifest_head", "the head of the chain, which counts the manifests, is missing"),
        ("UPDATE manifests SET signature = x'00'", "its signature does not fit"),
        ("UPDATE manifests SET signature = NULL WHERE sequence > 4", "are not signed by the key that was given"),
    ],
)
def test_a_chain_that_was_changed_is_found(location: str, key: PublicKey, statement: str, says_so: str) -> None:
    with by_hand(location) as connection:
        connection.exec_driver_sql(statement)
    assert says(check(location, keys=[key]), "manifests", says_so), check(location, keys=[key]).findings


@pytest.mark.parametrize(
    ("statement", "part", "words"),
    [
        ("DELETE FROM api_keys WHERE name = 'head'", "key", "API key 'head' is missing"),
        (
            "INSERT INTO api_keys VALUES ('mine', 'approver', 'd', 0, NULL)",
            "key",
            "key mine was never sealed: it was made or changed without labctl",
        ),
        (
            "UPDATE certifications SET due_at = 99",
            "certification",
            "certification 1 (certify of OSU-FOG-2024 version 1)",
        ),
        (
            "UPDATE data_set_means SET std = NULL WHERE channel = 'gyro_z'",
            "recording",
            "means changed",
        ),
        ("UPDATE recordings SET info = 'x' WHERE id = 1", "recording", "recording 1: it cannot be read"),
    ],
)
def test_records_that_go_or_come_are_found(location: str, statement: str, part: str, words: str) -> None:
    with by_hand(location) as connection:
        connection.exec_driver_sql(statement)
    assert says(check(location), part, words), check(location).findings


def test_a_change_in_order_does_not_make_good_what_was_changed_by_hand(location: str) -> None:
    with by_hand(location) as connection:
        connection.exec_driver_sql("UPDATE api_keys SET role = 'approver' WHERE name = 'guest'")
    with open_store(location, write=True) as store:
        store.keys.revoke("guest", "gone", AT)
    assert says(check(location), "key", "API key 'guest': role had been changed by hand before")


def test_a_chain_that_does_not_fit_its_anchor_leaves_it(location: str) -> None:
    kept = anchor_path(location).read_bytes()
    with by_hand(location) as connection:
        EDITS["rates"][0](connection)
        write_chain_anew(connection)
    with open_store(location, write=True) as store:
        store.audit.record(AT, "noted", "something", {})
    assert anchor_path(location).read_bytes() == kept
    assert says(check(location), "manifests", "the chain was rewritten")


def test_an_anchor_that_lags_behind_is_no_finding(location: str) -> None:
    with by_hand(location) as connection:
        row = connection.exec_driver_sql("SELECT sequence, hash FROM manifests WHERE sequence = 3").one()
    head = check(location).head
    assert head is not None
    write_anchor(location, type(head)(row[0], row[1]))
    assert check(location).findings == ()
    anchor_path(location).write_text("torn", encoding="ascii")
    found = check(location)
    assert found.findings == ()
    assert "the anchor file is damaged" in found.remarks[0]


@pytest.fixture
def server(url: str) -> str:
    fill(url)
    return url


@pytest.mark.slow
def test_every_edit_is_found_on_a_server(server: str) -> None:
    assert check(server).findings == ()
    head = check(server).head
    for edit, part, words in EDITS.values():
        with by_hand(server) as connection:
            edit(connection)
        assert says(check(server), part, words), (words, check(server).findings)
    with by_hand(server) as connection:
        write_chain_anew(connection)
    assert says(check(server, chain_anchor=head), "manifests", "the chain was rewritten")

"""Bundles: certified calibrations of many units in one file; what is damaged, forged, old or withdrawn is refused."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Iterator
from datetime import timedelta
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from instruments.clock import VirtualClock
from labctl.answers.certification import RevokeRequest
from labctl.bundle import MANIFEST, SIGNATURE, signed_digest
from labctl.canonical_json import canonical
from labctl.cli.app import app
from labctl.client import Bundle
from labctl.compensator import Compensator
from labctl.errors import (
    BadCalibrationFile,
    BadInput,
    BundleExpired,
    CalibrationOverdue,
    CalibrationWithdrawn,
    NotFound,
)
from labctl.services.admin.seal_keys import create_seal_key
from labctl.services.calibrations.bundle import BundleOptions, write_bundle
from labctl.services.calibrations.certification import revoke
from labctl.services.calibrations.served import calibration_file
from labctl.store import Store, open_store, signer_of
from tests.helpers.certificates import AT, SERIAL, add_version

DUE = AT + timedelta(days=365)
LATER = AT + timedelta(days=1)


@pytest.fixture(scope="module")
def location(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A database with a unit whose version is in force."""
    path = str(tmp_path_factory.mktemp("bundle") / "lab.sqlite")
    with open_store(path, write=True) as store:
        made = add_version(store, certified=False)
        store.calibrations.certify(SERIAL, made, "certify", by="Ada", reason="r", at=AT, due_at=DUE)
    return path


@pytest.fixture
def store(location: str) -> Iterator[Store]:
    with open_store(location, write=False) as opened:
        yield opened


@pytest.fixture
def key(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The public part of the seal key."""
    create_seal_key(tmp_path / "seal.pem")
    monkeypatch.setenv("LABCTL_SEAL_KEY", str(tmp_path / "seal.pem"))
    return tmp_path / "seal.pem.pub"


@pytest.fixture
def file(store: Store, key: Path, tmp_path: Path) -> Path:
    write_bundle(store, tmp_path / "all.zip", BundleOptions(None), AT)
    return tmp_path / "all.zip"


def test_a_bundle_gives_the_bytes_and_the_compensator_of_the_service(store: Store, file: Path, key: Path) -> None:
    served = calibration_file(store, SERIAL, None, "json").content
    with Bundle.open(file, public_key=key, clock=VirtualClock(LATER)) as bundle:
        assert (bundle.serials, bundle.is_signature_checked) == ((SERIAL,), True)
        assert bundle.content(SERIAL) == served
        bundle.verify()
        output_dps = np.array([[-30.0], [0.0], [30.0]])
        found = bundle.compensator(SERIAL).compensate(output_dps, 25.0).rate_dps
        expected = Compensator.from_bytes(served).compensate(output_dps, 25.0).rate_dps
        assert np.array_equal(found, expected)
        with pytest.raises(NotFound, match=r"no calibration of unit 'X' among 1"):
            bundle.content("X")


def test_the_same_calibrations_give_the_same_bytes(store: Store, file: Path, tmp_path: Path) -> None:
    model = store.units.get(SERIAL).model
    again = write_bundle(store, tmp_path / "again.zip", BundleOptions(None), AT)
    assert (tmp_path / "again.zip").read_bytes() == file.read_bytes()
    of_model = write_bundle(store, tmp_path / "model.zip", BundleOptions(model), AT)
    assert (again.calibrations, of_model.calibrations, of_model.model) == (1, 1, model)
    with pytest.raises(NotFound, match="no unit of the model 'STIM300' has a certified version"):
        write_bundle(store, tmp_path / "none.zip", BundleOptions("STIM300"), AT)
    with pytest.raises(BadInput, match="the file exists already"):
        write_bundle(store, file, BundleOptions(None), AT)
    assert {each.name for each in tmp_path.glob("*.zip")} == {"all.zip", "again.zip", "model.zip"}
    assert not list(tmp_path.glob(".*"))


def rewritten(file: Path, **changed: bytes | None) -> Path:
    """Write a bundle again with members changed, by the last part of their name, or left out."""
    made = file.with_name("changed.zip")
    with zipfile.ZipFile(file) as old, zipfile.ZipFile(made, "w") as new:
        for name in old.namelist():
            content = changed.get(Path(name).stem.lstrip("0") or name, old.read(name))
            if content is not None:
                new.writestr(name, content)
    return made


def member(file: Path, name: str) -> bytes:
    with zipfile.ZipFile(file) as opened:
        return opened.read(name)


def test_what_was_changed_is_refused(file: Path, key: Path) -> None:
    clock = VirtualClock(LATER)
    calibration = member(file, "calibrations/0000001.json")
    forged = calibration.replace(b'"by":"Ada"', b'"by":"Eve"')
    assert forged != calibration
    with (
        Bundle.open(rewritten(file, **{"1": forged}), clock=clock) as bundle,
        pytest.raises(BadCalibrationFile, match=r"of unit FOG-0001 has the SHA-256 .*: the file was changed"),
    ):
        bundle.calibration(SERIAL)
    manifest = json.loads(member(file, MANIFEST))
    manifest["expires_at"] = "2099-01-01T00:00:00+00:00"
    changed = rewritten(file, manifest=canonical(manifest))
    with Bundle.open(changed, clock=clock) as bundle:
        assert not bundle.is_signature_checked
    with pytest.raises(BadCalibrationFile, match=r"is none of the key .* over this content"):
        Bundle.open(changed, public_key=key, clock=clock)
    with pytest.raises(BadCalibrationFile, match="the bundle has no signature"):
        Bundle.open(rewritten(file, signature=None), public_key=key, clock=clock)
    with pytest.raises(BadCalibrationFile, match=r"signature\.json is not whole"):
        Bundle.open(rewritten(file, signature=b"[]"), public_key=key, clock=clock)


def test_another_laboratory_s_key_is_refused(file: Path, tmp_path: Path) -> None:
    create_seal_key(tmp_path / "other.pem")
    with pytest.raises(BadCalibrationFile, match="another laboratory's"):
        Bundle.open(file, public_key=tmp_path / "other.pem.pub", clock=VirtualClock(LATER))
    for absent in (tmp_path, tmp_path / "absent.pub"):
        with pytest.raises(BadInput, match=f"{absent}: the public key cannot be read .*; name the .pub file"):
            Bundle.open(file, public_key=absent)


def test_a_signature_of_the_key_over_something_else_is_refused(file: Path, key: Path) -> None:
    content = member(file, MANIFEST)
    said = json.loads(member(file, SIGNATURE))
    signer = signer_of(str(key).removesuffix(".pub"))
    good = {**said, "signature": signer.sign(signed_digest(content)).hex()}
    Bundle.open(rewritten(file, signature=json.dumps(good).encode()), public_key=key, clock=VirtualClock(LATER)).close()
    plain = {**said, "signature": signer.sign(json.loads(content)["calibrations"][0]["sha256"]).hex()}
    with pytest.raises(BadCalibrationFile, match="is none of the key"):
        Bundle.open(rewritten(file, signature=json.dumps(plain).encode()), public_key=key, clock=VirtualClock(LATER))


@pytest.mark.parametrize(
    "content", [b"", b"[]", b'{"format": "labctl-bundle/9"}', b'{"format": "labctl-bundle/1"}', b"\xff", b"[" * 100_000]
)
def test_a_manifest_that_is_not_whole_is_refused(file: Path, content: bytes) -> None:
    with pytest.raises(BadCalibrationFile, match=r"manifest\.json is not whole"):
        Bundle.open(rewritten(file, manifest=content))


def test_a_file_that_is_no_bundle_is_refused(file: Path, tmp_path: Path) -> None:
    whole = file.read_bytes()
    cut = tmp_path / "cut.zip"
    for content in (b"", b"PK\x03\x04", whole[: len(whole) // 2], whole[:-30]):
        cut.write_bytes(content)
        with pytest.raises(BadCalibrationFile, match="not a bundle of calibrations"):
            Bundle.open(cut)
    with pytest.raises(BadCalibrationFile, match=r"manifest\.json cannot be read"):
        Bundle.open(rewritten(file, manifest=None))


def test_every_damaged_byte_is_refused_or_harmless(file: Path, store: Store, tmp_path: Path) -> None:
    """A byte that is changed anywhere gives an error of labctl, or the very calibration."""
    whole, served = file.read_bytes(), calibration_file(store, SERIAL, None, "json").content
    hurt, refused = tmp_path / "hurt.zip", 0
    places = range(0, len(whole), max(len(whole) // 150, 1))
    for place in places:
        hurt.write_bytes(whole[:place] + bytes([whole[place] ^ 0x41]) + whole[place + 1 :])
        try:
            with Bundle.open(hurt, clock=VirtualClock(LATER)) as bundle:
                assert bundle.content(SERIAL) == served
        except (BadCalibrationFile, NotFound):
            refused += 1
    assert refused > len(places) // 2


def test_a_date_that_has_passed_is_refused(store: Store, key: Path, tmp_path: Path) -> None:
    write_bundle(store, tmp_path / "30.zip", BundleOptions(None, timedelta(days=30)), AT)
    Bundle.open(tmp_path / "30.zip", clock=VirtualClock(AT + timedelta(days=29))).close()
    with pytest.raises(BundleExpired, match=r"made at 2027-03-01 12:00 UTC and expired at 2027-03-31 12:00 UTC"):
        Bundle.open(tmp_path / "30.zip", clock=VirtualClock(AT + timedelta(days=30)))
    write_bundle(store, tmp_path / "long.zip", BundleOptions(None), AT)
    with (
        Bundle.open(tmp_path / "long.zip", clock=VirtualClock(DUE)) as bundle,
        pytest.raises(CalibrationOverdue, match=r"calibration of FOG-0001 version 1 was due on .*, 0\.0 days ago"),
    ):
        bundle.compensator(SERIAL)


def test_a_version_that_was_withdrawn_is_named_and_refused(key: Path, tmp_path: Path) -> None:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        add_version(store)
        revoke(store, SERIAL, 1, RevokeRequest(by="Rita", reason="was dropped"), AT)
        answer = write_bundle(store, tmp_path / "gone.zip", BundleOptions(None), AT)
    assert (answer.calibrations, answer.withdrawn) == (0, 1)
    with (
        Bundle.open(tmp_path / "gone.zip", public_key=key) as bundle,
        pytest.raises(CalibrationWithdrawn, match=r"FOG-0001 version 1 must not be used: .* by Rita \(was dropped\)"),
    ):
        bundle.compensator(SERIAL)


def test_the_command_signs_or_says_what_is_missing(
    location: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def run(*words: str) -> tuple[int, str]:
        done = CliRunner().invoke(app, ["export", "bundle", *words, "--database", location])
        return done.exit_code, done.output

    monkeypatch.delenv("LABCTL_SEAL_KEY", raising=False)
    file = str(tmp_path / "b.zip")
    assert run(file) == (2, "labctl: a bundle is of one model or of all units; give either --type NAME or --all\n")
    status, said = run(file, "--all")
    assert (status, "LABCTL_SEAL_KEY is not set" in said) == (2, True), said
    status, said = run(file, "--all", "--unsigned", "--valid-days", "90", "--json")
    answer = json.loads(said)
    assert (status, answer["signed_by"], answer["calibrations"]) == (0, None, 1)
    assert Bundle.open(file).manifest.expires_at is not None

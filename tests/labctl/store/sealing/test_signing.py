"""Signing: keys in files and in tokens, after the fact, and never in the way of what is written."""

from __future__ import annotations

import os
import shutil
import subprocess
import threading
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

import pytest
from typer.testing import CliRunner

from labctl.cli.app import app
from labctl.errors import BadInput
from labctl.private_keys import token_uri
from labctl.public_keys import public_key
from labctl.services.admin.seal_keys import create_seal_key, sign
from labctl.store import Store, check, open_store, read_public_key, signer_of
from labctl.store.connection.database import Database
from labctl.store.sealing import signing
from labctl.store.sealing.signers import SEAL_KEY, Signer

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)
MODULES = ("/usr/lib/softhsm/libsofthsm2.so", "/usr/lib/x86_64-linux-gnu/softhsm/libsofthsm2.so")


@pytest.fixture
def seal_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    create_seal_key(tmp_path / "seal.pem")
    monkeypatch.setenv("LABCTL_SEAL_KEY", str(tmp_path / "seal.pem"))
    return tmp_path / "seal.pem"


def note(location: str) -> None:
    with open_store(location, write=True) as store:
        store.keys.add("A", "viewer", "0" * 64, AT)


def test_what_is_written_is_signed(seal_file: Path, tmp_path: Path) -> None:
    location = str(tmp_path / "lab.sqlite")
    note(location)
    found = check(location, keys=[read_public_key(Path(f"{seal_file}.pub"))])
    assert found.findings == ()
    assert found.signed == found.manifests == 1


def test_another_key_does_not_fit(seal_file: Path, tmp_path: Path) -> None:
    location = str(tmp_path / "lab.sqlite")
    note(location)
    create_seal_key(tmp_path / "other.pem")
    (finding,) = check(location, keys=[read_public_key(tmp_path / "other.pem.pub")]).findings
    assert "is not signed by the key that was given" in finding.text


def test_an_ecdsa_key_of_openssl_is_used_too(tmp_path: Path) -> None:
    from cryptography.hazmat.primitives.asymmetric.ec import SECP256R1, generate_private_key
    from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat

    file = tmp_path / "p256.pem"
    key = generate_private_key(SECP256R1())
    file.write_bytes(key.private_bytes(Encoding.PEM, PrivateFormat.TraditionalOpenSSL, NoEncryption()))
    file.chmod(0o600)
    signer = signer_of(str(file))
    assert signer.public.fits(signer.sign("a" * 64), "a" * 64)
    assert not signer.public.fits(signer.sign("a" * 64), "b" * 64)


@pytest.mark.parametrize("mode", [0o640, 0o604, 0o620])
def test_a_key_that_others_can_reach_is_refused(seal_file: Path, mode: int) -> None:
    seal_file.chmod(mode)
    with pytest.raises(BadInput, match=f"mode is {mode:04o}.*chmod 600"):
        signer_of(str(seal_file))


def test_a_key_that_cannot_be_used_stops_no_write(seal_file: Path, tmp_path: Path) -> None:
    location = str(tmp_path / "lab.sqlite")
    seal_file.chmod(0o644)
    note(location)
    assert (check(location).manifests, check(location).signed) == (1, 0)
    seal_file.chmod(0o600)
    assert sign(location).signed == 1
    assert sign(location).signed is None
    assert check(location).signed == 1


def test_what_a_process_left_without_a_signature_is_signed_by_the_next(
    seal_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    location = str(tmp_path / "lab.sqlite")
    monkeypatch.delenv("LABCTL_SEAL_KEY")
    note(location)
    monkeypatch.setenv("LABCTL_SEAL_KEY", str(seal_file))
    with open_store(location, write=True):
        pass
    assert check(location).signed == 1


class _Hanging:
    """A token that answers when a test lets it."""

    def __init__(self, signer: Signer) -> None:
        self.pem, self.public, self._signer = signer.pem, signer.public, signer
        self.asked, self.answers = threading.Event(), threading.Event()

    def sign(self, digest: str) -> bytes:
        self.asked.set()
        self.answers.wait(30)
        return self._signer.sign(digest)


def test_a_token_that_hangs_delays_no_write_and_writes_nothing_afterwards(
    seal_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    location = str(tmp_path / "lab.sqlite")
    hanging = _Hanging(signer_of(str(seal_file)))
    monkeypatch.setattr(signing, "signer_of", lambda _: hanging)
    monkeypatch.setattr(signing, "LAST_SIGNATURE_S", 0.0)
    store = Store(Database(location, write=True))
    store.keys.add("A", "viewer", "0" * 64, AT)
    assert hanging.asked.wait(30)
    store.keys.add("B", "viewer", "1" * 64, AT)  # while it hangs
    thread = store._signing._thread if store._signing else threading.current_thread()
    store.close()
    hanging.answers.set()
    thread.join(30)
    found = check(location)
    assert (found.manifests, found.signed, found.findings) == (2, 0, ())


def test_the_commands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def labctl(*arguments: str, status: int = 0) -> str:
        result = CliRunner().invoke(app, [*arguments, "--database", str(tmp_path / "lab.sqlite")])
        assert result.exit_code == status, result.output
        return result.output

    said = labctl("seal-key", "create", str(tmp_path / "k.pem"))
    assert "fingerprint: " in said
    assert "never overwritten" in labctl("seal-key", "create", str(tmp_path / "k.pem"), status=2)
    assert (tmp_path / "k.pem").stat().st_mode & 0o777 == 0o600
    assert "LABCTL_SEAL_KEY is not set" in labctl("seal-key", "show", status=2)
    note(str(tmp_path / "lab.sqlite"))
    public = str(tmp_path / "k.pem.pub")
    assert "manifest 1 is not signed" in labctl("check", "--key", public, status=1)
    monkeypatch.setenv("LABCTL_SEAL_KEY", str(tmp_path / "k.pem"))
    assert labctl("seal-key", "show").startswith("-----BEGIN PUBLIC KEY-----")
    assert "was signed: manifests 1 to 1" in labctl("seal-key", "sign")
    assert "signed already" in labctl("seal-key", "sign")
    assert "1 signed by" in labctl("check", "--key", public)
    assert "not verified: give --key" in labctl("check")
    assert "expected LENGTH:HASH" in labctl("check", "--anchor", "7", status=2)
    assert "no public key in PEM form" in labctl("check", "--key", str(tmp_path / "k.pem"), status=2)


def test_a_pkcs11_uri_is_read(tmp_path: Path) -> None:
    pin = tmp_path / "pin"
    pin.write_text("1234\n", encoding="utf-8")
    pin.chmod(0o600)
    found = token_uri(f"pkcs11:token=The%20lab;object=seal?module-path=/lib/x.so&pin-source=file:{pin}", SEAL_KEY)
    assert (found.token, found.object, found.module, found.pin) == ("The lab", "seal", "/lib/x.so", "1234")
    with pytest.raises(BadInput, match="has no object, module-path"):
        token_uri("pkcs11:token=a", SEAL_KEY)
    pin.chmod(0o644)
    with pytest.raises(BadInput, match="mode is 0644"):
        token_uri(f"pkcs11:token=a;object=b?module-path=c&pin-source={pin}", SEAL_KEY)


@pytest.fixture
def token(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """The URI of an ECDSA key in a token of SoftHSM2 of this test's own."""
    module = next((each for each in MODULES if Path(each).exists()), None)
    if module is None or shutil.which("softhsm2-util") is None or shutil.which("pkcs11-tool") is None:
        pytest.skip("no SoftHSM2 and pkcs11-tool (on Debian: apt-get install softhsm2 opensc)")
    (tmp_path / "tokens").mkdir()
    settings = tmp_path / "softhsm2.conf"
    settings.write_text(f"directories.tokendir = {tmp_path / 'tokens'}\n", encoding="utf-8")
    monkeypatch.setenv("SOFTHSM2_CONF", str(settings))
    pin = tmp_path / "pin"
    pin.write_text("1234", encoding="utf-8")
    pin.chmod(0o600)
    for command in (
        ["softhsm2-util", "--init-token", "--free", "--label", "lab", "--pin", "1234", "--so-pin", "5678"],
        ["pkcs11-tool", "--module", module, "--token-label", "lab", "--login", "--pin", "1234", "--keypairgen",
         "--key-type", "EC:prime256v1", "--label", "seal", "--id", "01"],
    ):  # fmt: skip
        subprocess.run(command, check=True, capture_output=True, env=os.environ)
    return f"pkcs11:token=lab;object=seal?module-path={module}&pin-source={pin}"


#: One process can load a PKCS#11 module once, with one set-up, so all is in one test.
def test_a_key_in_a_token_signs(token: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LABCTL_SEAL_KEY", token)
    location = str(tmp_path / "lab.sqlite")
    note(location)
    signer = signer_of(token)
    key = public_key(signer.pem, "the token")
    found = check(location, keys=[key])
    assert (found.findings, found.signed, found.keys) == ((), 1, (key.fingerprint,))
    with pytest.raises(BadInput, match="check token, object, module and PIN"):
        signer_of(token.replace("object=seal", "object=other"))
    with pytest.raises(BadInput, match="check token, object, module and PIN"):
        signer_of(token.replace("token=lab", "token=none"))
    assert "1234" not in str(signer)

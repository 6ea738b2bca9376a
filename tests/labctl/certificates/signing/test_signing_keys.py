"""The signing key: from a PEM or PKCS#12 file or a token; what is wrong with one is said, with file and remedy."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from datetime import timedelta
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.hazmat.primitives.serialization import Encoding, load_der_public_key

from labctl.certificates.signing import SigningSettings
from labctl.certificates.signing.keys import SigningKey, fits, open_signing_key
from labctl.errors import BadInput
from tests.helpers.certificates import issued
from tests.helpers.signing import AT, Owner, key_file, owner, pdf_verifies, private_file, xml_verifies

MODULES = ("/usr/lib/softhsm/libsofthsm2.so", "/usr/lib/x86_64-linux-gnu/softhsm/libsofthsm2.so")


def opened(path: Path, **named: Path) -> SigningKey:
    return open_signing_key(SigningSettings(str(path), **{name: str(value) for name, value in named.items()}))


def test_a_key_signs_by_the_algorithm_of_its_kind(tmp_path: Path) -> None:
    for kind, digest in (("p256", "sha256"), ("p384", "sha384"), ("rsa2048", "sha256")):
        made = owner("Ada", kind)
        key = opened(key_file(tmp_path, made, f"{kind}.pem"))
        assert key.digest == digest
        assert fits(made.certificate.public_key(), key.digest, key.sign(b"some"), b"some")
        assert not fits(made.certificate.public_key(), key.digest, key.sign(b"some"), b"other")


def test_a_key_and_its_certificate_may_be_in_files_of_their_own(tmp_path: Path) -> None:
    authority = owner("Root", authority=True, signs=False)
    made = owner("Ada", issuer=authority)
    certificate = tmp_path / "chain.pem"
    certificate.write_bytes(authority.pem + made.pem)  # in any order
    key = opened(private_file(tmp_path / "key.pem", made.key_pem()), certificate=certificate)
    assert key.certificate == made.certificate
    assert key.chain == (authority.certificate,)
    assert key.signatory.issuer == "CN=Root,O=Lab & Sons"


@pytest.mark.parametrize("kind", ["pkcs12", "pem"])
def test_a_key_with_a_password_is_opened_by_the_file_that_holds_it(tmp_path: Path, kind: str) -> None:
    authority = owner("Root", authority=True, signs=False)
    made = owner("Ada", issuer=authority)
    closed = made.pkcs12(b"secret", (authority.certificate,)) if kind == "pkcs12" else (
        made.key_pem(b"secret") + made.pem + authority.pem
    )  # fmt: skip
    path = private_file(tmp_path / "key", closed)
    password = private_file(tmp_path / "password", b"secret\n")
    key = opened(path, password_file=password)
    assert (key.certificate, key.chain) == (made.certificate, (authority.certificate,))
    with pytest.raises(BadInput, match=r"it needs a password.*LABCTL_SIGN_PASSWORD_FILE"):
        opened(path)
    private_file(password, b"other")
    with pytest.raises(BadInput, match="LABCTL_SIGN_PASSWORD_FILE names does not open it") as error:
        opened(path, password_file=password)
    assert "other" not in str(error.value)
    password.chmod(0o644)
    with pytest.raises(BadInput, match=f"password file {password}: its mode is 0644.*chmod 600"):
        opened(path, password_file=password)


def test_pkcs12_without_a_password(tmp_path: Path) -> None:
    made = owner("Ada", "rsa2048")
    assert opened(private_file(tmp_path / "key.p12", made.pkcs12(None))).certificate == made.certificate


def _mode(path: Path, _: Owner) -> None:
    path.chmod(0o640)


def _gone(path: Path, _: Owner) -> None:
    path.unlink()


def _no_certificate(path: Path, made: Owner) -> None:
    private_file(path, made.key_pem())


def _other_certificate(path: Path, made: Owner) -> None:
    private_file(path, made.key_pem() + owner("Eve").pem)


def _no_key(path: Path, _: Owner) -> None:
    private_file(path, b"no key at all")


def _only_certificate(path: Path, made: Owner) -> None:
    private_file(path, made.pem)


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (_mode, "its mode is 0640, so others than its owner have access to it; run `chmod 600"),
        (_gone, "No such file or directory; name an existing file by LABCTL_SIGN_KEY"),
        (_no_certificate, "it holds no certificate; name a PEM file with it by LABCTL_SIGN_CERTIFICATE"),
        (_other_certificate, r"the key is not that of the certificate \(CN=Eve,O=Lab & Sons\); nothing was signed"),
        (_no_key, "this is no private key in PEM form or PKCS#12; name such a file"),
        (_only_certificate, "this is no private key in PEM form or PKCS#12; name such a file"),
    ],
)
def test_what_is_wrong_with_a_file_is_said(tmp_path: Path, spoil: Callable[[Path, Owner], None], said: str) -> None:
    made = owner("Ada")
    path = key_file(tmp_path, made)
    opened(path)
    spoil(path, made)
    with pytest.raises(BadInput, match=f"signing key {path}: {said}"):
        opened(path)


@pytest.mark.parametrize("kind", ["rsa1024", "ed25519", "p521"])
def test_other_kinds_of_keys_are_refused(tmp_path: Path, kind: str) -> None:
    with pytest.raises(BadInput, match="this kind of key is not used; give an RSA key of 2048 bits"):
        opened(key_file(tmp_path, owner("Ada", kind)))


def test_a_certificate_that_is_not_for_signatures_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"\(CN=Ada,O=Lab & Sons\) is not for signatures \(key usage\)"):
        opened(key_file(tmp_path, owner("Ada", signs=False)))


def test_a_certificate_signs_while_it_is_valid(tmp_path: Path) -> None:
    key = opened(key_file(tmp_path, owner("Ada", days=(0, 10))))
    key.refuse_outside_validity(AT)
    with pytest.raises(
        BadInput, match="has expired: it is valid from 2027-03-01 to 2027-03-11, and today is 2027-03-12"
    ):
        key.refuse_outside_validity(AT + timedelta(days=11))
    with pytest.raises(BadInput, match="is not valid yet"):
        key.refuse_outside_validity(AT - timedelta(days=1))


def test_a_file_of_certificates_that_is_none_is_said(tmp_path: Path) -> None:
    key = key_file(tmp_path, owner("Ada"))
    with pytest.raises(BadInput, match=f"certificate {tmp_path}/none.pem: No such file"):
        opened(key, certificate=tmp_path / "none.pem")
    (tmp_path / "bad.pem").write_text("x", encoding="utf-8")
    with pytest.raises(BadInput, match=r"bad\.pem: this is no certificate in PEM form"):
        opened(key, certificate=tmp_path / "bad.pem")


def _token(folder: Path, kind: str) -> str:
    """Make a token of SoftHSM2 with one key; return the URI of the key."""
    module = next((each for each in MODULES if Path(each).exists()), None)
    if module is None or shutil.which("softhsm2-util") is None or shutil.which("pkcs11-tool") is None:
        pytest.skip("no SoftHSM2 and pkcs11-tool (on Debian: apt-get install softhsm2 opensc)")
    (folder / "tokens").mkdir()
    (folder / "softhsm2.conf").write_text(f"directories.tokendir = {folder / 'tokens'}\n", encoding="utf-8")
    pin = private_file(folder / "pin", b"1234")
    tool = ["pkcs11-tool", "--module", module, "--token-label", "lab", "--login", "--pin", "1234"]
    named = ["--label", "signing", "--id", "01"]
    for command in (
        ["softhsm2-util", "--init-token", "--free", "--label", "lab", "--pin", "1234", "--so-pin", "5678"],
        [*tool, "--keypairgen", "--key-type", kind, *named],
        [*tool, "--read-object", "--type", "pubkey", *named, "--output-file", str(folder / "public.der")],
    ):
        _run(folder, *command)
    public = load_der_public_key((folder / "public.der").read_bytes())
    made = owner("Token", public_key=public, issuer=owner("Root", authority=True, signs=False)).certificate
    (folder / "own.der").write_bytes(made.public_bytes(Encoding.DER))
    (folder / "own.pem").write_bytes(made.public_bytes(Encoding.PEM))
    _run(folder, *tool, "--write-object", str(folder / "own.der"), "--type", "cert", *named)
    return f"pkcs11:token=lab;object=signing?module-path={module}&pin-source={pin}"


def _run(folder: Path, *command: str) -> str:
    environment = {**os.environ, "SOFTHSM2_CONF": str(folder / "softhsm2.conf")}
    return subprocess.run(command, check=True, capture_output=True, env=environment, text=True).stdout


#: A process loads a PKCS#11 module once, with one set-up, so each token has a process of its own.
IN_TOKEN = """
import json, sys
from datetime import datetime
from pathlib import Path
from labctl.certificates.signing import SigningSettings
from labctl.certificates.signing.keys import open_signing_key
from labctl.certificates.signing.pades import sign_pdf
from labctl.certificates.signing.xades import sign_dcc
from labctl.errors import BadInput
uri, folder, at = sys.argv[1], Path(sys.argv[2]), datetime.fromisoformat(sys.argv[3])
key = open_signing_key(SigningSettings(uri))
(folder / "out.xml").write_bytes(sign_dcc((folder / "in.xml").read_bytes(), key, at))
(folder / "out.pdf").write_bytes(sign_pdf((folder / "in.pdf").read_bytes(), key, at))
said = []
for settings in (
    SigningSettings(uri.replace("object=signing", "object=other")), SigningSettings(uri, str(folder / "other.pem")),
):
    try:
        open_signing_key(settings).sign(b"")
    except BadInput as error:
        said.append(str(error))
print(json.dumps(said))
"""


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["EC:prime256v1", "rsa:2048"])
def test_a_key_in_a_token_signs_pdf_and_dcc(tmp_path: Path, kind: str) -> None:
    uri = _token(tmp_path, kind)
    (tmp_path / "in.xml").write_bytes(issued()[1].xml)
    (tmp_path / "in.pdf").write_bytes(issued()[1].pdf)
    other = owner("Eve", "p256" if kind.startswith("EC") else "rsa2048")
    (tmp_path / "other.pem").write_bytes(other.pem)
    said = json.loads(_run(tmp_path, sys.executable, "-c", IN_TOKEN, uri, str(tmp_path), AT.isoformat()))
    made = x509.load_pem_x509_certificate((tmp_path / "own.pem").read_bytes())
    assert xml_verifies((tmp_path / "out.xml").read_bytes(), made)
    assert pdf_verifies((tmp_path / "out.pdf").read_bytes(), made)
    assert "signing key pkcs11:token=lab;object=other: " in said[0]
    assert "check token, object, module and PIN" in said[0]
    assert "the key is not that of the certificate (CN=Eve,O=Lab & Sons)" in said[1]
    assert "1234" not in "".join(said)

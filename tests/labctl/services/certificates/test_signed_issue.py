"""Signing when a certificate is issued: once, by the key that is set; and the verification of its files."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path

import pikepdf
import pytest
import tomli_w
from cryptography.hazmat.primitives.hashes import SHA256

from labctl.answers.certificates import SignatoryResponse, WithdrawRequest
from labctl.errors import BadInput
from labctl.services.admin.seal_keys import refuse_unusable_keys
from labctl.services.certificates.issue import CertificateRefused, issue, withdraw
from labctl.services.certificates.served import list_certificates
from labctl.services.certificates.verification import verify_file
from labctl.store import CertificateForms, Store, copy_database, open_store
from tests.helpers.certificates import AT, ORDER, SERIAL, add_version, issued, request
from tests.helpers.lab import Lab
from tests.helpers.service import open_client
from tests.helpers.signing import Owner, key_file, owner, pdf_verifies, xml_verifies

LONG = (-3650, 3650)  #: days; commands and services read the real date

#: A signature whose certificate (X.509) is empty.
EMPTY_CERTIFICATE = (
    b'<a xmlns:ds="http://www.w3.org/2000/09/xmldsig#"><ds:Signature><ds:X509Certificate/></ds:Signature></a>'
)


@pytest.fixture(scope="module")
def with_version(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("certificates") / "lab.sqlite"
    with open_store(str(path), write=True) as opened:
        add_version(opened)
    return path


@pytest.fixture
def store(with_version: Path, tmp_path: Path) -> Iterator[Store]:
    copy_database(str(with_version), tmp_path / "lab.sqlite")
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as opened:
        yield opened


@pytest.fixture
def authority() -> Owner:
    return owner("Root authority", authority=True, signs=False, days=LONG)


@pytest.fixture
def signer(authority: Owner, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Owner:
    """The owner of the signing key that is set."""
    made = owner("Ada Authoriser", issuer=authority, days=LONG)
    monkeypatch.setenv("LABCTL_SIGN_KEY", str(key_file(tmp_path, made)))
    return made


def issued_file(store: Store, number: str, form: str, folder: Path) -> Path:
    forms = store.certificates.forms(number)
    path = folder / f"certificate.{form}"
    path.write_bytes({"pdf": forms.pdf, "xml": forms.xml, "json": forms.document}[form])
    return path


def test_issue_signs_and_names_the_signer(store: Store, signer: Owner) -> None:
    answer = issue(store, SERIAL, 1, request(), AT)
    forms = store.certificates.forms(answer.number)
    named = SignatoryResponse(
        subject="CN=Ada Authoriser,O=Lab & Sons", issuer="CN=Root authority,O=Lab & Sons",
        fingerprint=signer.certificate.fingerprint(SHA256()).hex(),
    )  # fmt: skip
    assert answer.signed_by == named
    assert json.loads(forms.document)["signed_by"] == named.model_dump()
    assert xml_verifies(forms.xml, signer.certificate)
    assert pdf_verifies(forms.pdf, signer.certificate)
    with pikepdf.open(BytesIO(forms.pdf)) as opened:
        assert opened.attachments["dcc.xml"].get_file().read_bytes() == forms.xml
    (listed,) = list_certificates(store, SERIAL)
    assert listed.signed_by == named


def test_what_was_issued_stays_as_it_is(store: Store, signer: Owner, monkeypatch: pytest.MonkeyPatch) -> None:
    first = issue(store, SERIAL, 1, request(), AT)
    before = store.certificates.forms(first.number)
    assert issue(store, SERIAL, 1, request(), AT) == first  # another signature would have other bytes (ECDSA)
    monkeypatch.delenv("LABCTL_SIGN_KEY")
    assert issue(store, SERIAL, 1, request(), AT) == first
    assert store.certificates.forms(first.number) == before
    amended = request().model_copy(update={"amend": "address"})
    with pytest.raises(CertificateRefused, match=f"{first.number} is signed.*name the key by .*LABCTL_SIGN_KEY"):
        issue(store, SERIAL, 1, amended, AT)
    assert [row.number for row in store.certificates.of_unit(SERIAL)] == [first.number]
    assert signer.pem not in before.xml


@pytest.mark.parametrize(
    ("days", "said"), [((-30, -1), "has expired"), ((1, 30), "is not valid yet"), (None, "name an existing file")]
)
def test_a_key_that_cannot_sign_issues_nothing(
    store: Store, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, days: tuple[float, float] | None, said: str
) -> None:
    path = tmp_path / "none.pem" if days is None else key_file(tmp_path, owner("Ada", days=days))
    monkeypatch.setenv("LABCTL_SIGN_KEY", str(path))
    with pytest.raises(BadInput, match=said):
        issue(store, SERIAL, 1, request(), AT)
    assert list_certificates(store, SERIAL) == []
    monkeypatch.delenv("LABCTL_SIGN_KEY")
    assert issue(store, SERIAL, 1, request(), AT).number.endswith("0001")


def test_a_service_does_not_start_with_a_key_that_others_can_read(signer: Owner, tmp_path: Path) -> None:
    refuse_unusable_keys()
    (tmp_path / "key.pem").chmod(0o644)
    with pytest.raises(BadInput, match="its mode is 0644"):
        refuse_unusable_keys()


@pytest.mark.slow
def test_without_a_key_no_library_for_signatures_is_loaded(tmp_path: Path) -> None:
    (tmp_path / "certificate.json").write_bytes(issued()[1].document)
    script = """
import sys
from datetime import UTC, datetime
from pathlib import Path
from labctl.certificates.document import Certificate
from labctl.services.certificates import issue, served, verification
from labctl.services.certificates.signature import forms_of, signing_key
given, at = Certificate.model_validate_json(Path(sys.argv[1]).read_bytes()), datetime.now(UTC)
with signing_key(at) as key:
    assert key is None and forms_of(given, key, at).pdf
print([name for name in ("pyhanko", "signxml", "lxml", "cryptography", "asn1crypto", "pkcs11") if name in sys.modules])
"""
    command = [sys.executable, "-c", script, str(tmp_path / "certificate.json")]
    assert subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip() == "[]"


@pytest.mark.parametrize("form", ["pdf", "xml", "json"])
@pytest.mark.parametrize("with_key", [True, False])
def test_a_file_as_it_was_issued_is_verified(
    store: Store, tmp_path: Path, signer: Owner, monkeypatch: pytest.MonkeyPatch, form: str, with_key: bool
) -> None:
    if not with_key:
        monkeypatch.delenv("LABCTL_SIGN_KEY")
    number = issue(store, SERIAL, 1, request(), AT).number
    said = verify_file(store, issued_file(store, number, form, tmp_path), None)
    assert (said.ok, said.in_register, said.format, said.number) == (True, "same", form, number)
    assert said.certificate is not None
    signatures = [each.form for each in said.signatures]
    assert signatures == ({"pdf": ["PAdES", "XAdES"], "xml": ["XAdES"], "json": []}[form] if with_key else [])
    assert all(each.valid for each in said.signatures)


def unsigned(forms: CertificateForms) -> bytes:
    """Return the PDF without what was appended to it."""
    return forms.pdf[: forms.pdf.index(b"%%EOF") + 6]


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"[" * 200_000, None),
        (b'{"number": "\\ud800"}', None),
        (
            b'<a xmlns:ds="http://www.w3.org/2000/09/xmldsig#"><ds:Signature><ds:X509Certificate/></ds:Signature></a>',
            "",
        ),
    ],
    ids=["nested", "surrogate", "empty certificate"],
)
def test_a_damaged_file_is_no_traceback(store: Store, tmp_path: Path, content: bytes, said: str | None) -> None:
    (tmp_path / "file").write_bytes(content)
    if content.startswith(b"["):
        with pytest.raises(BadInput, match="this is no PDF, XML or JSON file"):
            verify_file(store, tmp_path / "file", None)
    elif said is None:
        assert not verify_file(store, tmp_path / "file", None).ok
    else:
        with pytest.raises(BadInput, match="its signature cannot be read"):
            verify_file(store, tmp_path / "file", None)


@pytest.mark.parametrize(
    "spoil",
    [
        lambda forms: forms.pdf.replace(b"/Author", b"/Auther", 1),
        lambda forms: forms.xml.replace(b"Vehicle Works", b"Vehicle Worke", 1),
        lambda forms: forms.document.replace(b"Vehicle Works", b"Vehicle Worke", 1),
        unsigned,
    ],
)
def test_a_file_that_was_changed_is_not(
    store: Store, tmp_path: Path, signer: Owner, spoil: Callable[[CertificateForms], bytes]
) -> None:
    number = issue(store, SERIAL, 1, request(), AT).number
    forms = store.certificates.forms(number)
    content = spoil(forms)
    assert content not in (forms.pdf, forms.xml, forms.document)
    (tmp_path / "file").write_bytes(content)
    said = verify_file(store, tmp_path / "file", None)
    assert (said.ok, said.in_register) == (False, "differs")


def test_another_laboratory_verifies_by_the_authority(
    store: Store, tmp_path: Path, signer: Owner, authority: Owner
) -> None:
    number = issue(store, SERIAL, 1, request(), AT).number
    path = issued_file(store, number, "pdf", tmp_path)
    (tmp_path / "ca.pem").write_bytes(authority.pem)
    (tmp_path / "other.pem").write_bytes(owner("Root authority", authority=True, signs=False).pem)
    with open_store(str(tmp_path / "customer.sqlite"), write=True) as other:
        alone = verify_file(other, path, None)
        assert (alone.ok, alone.in_register, alone.certificate) == (False, "unknown", None)
        assert {each.trust for each in alone.signatures} == {"not established"}
        trusted = verify_file(other, path, tmp_path / "ca.pem")
        assert trusted.ok
        assert {each.trust for each in trusted.signatures} == {"trusted"}
        assert not verify_file(other, path, tmp_path / "other.pem").ok
    assert not verify_file(store, path, tmp_path / "other.pem").ok  # in the register, but not by whom it should be


def test_a_signed_dcc_does_not_vouch_for_the_pages_of_a_pdf(
    store: Store, tmp_path: Path, signer: Owner, authority: Owner
) -> None:
    """The signature of the PDF cut off, the signed DCC still attached: the pages may say anything."""
    number = issue(store, SERIAL, 1, request(), AT).number
    (tmp_path / "cut.pdf").write_bytes(unsigned(store.certificates.forms(number)))
    (tmp_path / "ca.pem").write_bytes(authority.pem)
    with open_store(str(tmp_path / "customer.sqlite"), write=True) as other:
        said = verify_file(other, tmp_path / "cut.pdf", tmp_path / "ca.pem")
    assert [(each.form, each.trust) for each in said.signatures] == [("XAdES", "trusted")]
    assert (said.ok, said.in_register) == (False, "unknown")


def test_a_replaced_certificate_is_said_to_be(store: Store, tmp_path: Path) -> None:
    first = issue(store, SERIAL, 1, request(), AT).number
    second = issue(store, SERIAL, 1, request().model_copy(update={"amend": "address"}), AT).number
    said = verify_file(store, issued_file(store, first, "json", tmp_path), None)
    assert said.certificate is not None
    assert said.certificate.replaced_by == second


ADA, BERT = "CN=Ada Authoriser,O=Lab & Sons", "CN=Bert"


@pytest.mark.parametrize("form", ["pdf", "xml", "json"])
def test_only_an_expected_signer_is_accepted(
    store: Store, tmp_path: Path, signer: Owner, authority: Owner, form: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An authority vouches for many; the reader knows who signs for the laboratory."""
    number = issue(store, SERIAL, 1, request(), AT).number
    path, ca = issued_file(store, number, form, tmp_path), tmp_path / "ca.pem"
    ca.write_bytes(authority.pem)
    print_of_key = signer.certificate.fingerprint(SHA256()).hex(":").upper()
    for expected in ([ADA], ["O=Lab & Sons"], [print_of_key], [BERT, ADA]):
        said = verify_file(store, path, ca, expected)
        assert (said.ok, said.expected_signers) == (True, expected)
        assert said.signed_by is not None
        assert said.signed_by.subject == ADA
        assert all(each.expected for each in said.signatures)
    for expected in ([BERT], ["CN=Ada Authoriser,O=Other"], ["00" * 32]):
        said = verify_file(store, path, ca, expected)
        assert not said.ok
        assert not any(each.expected for each in said.signatures)
    assert {each.expected for each in verify_file(store, path, ca).signatures} <= {None}
    monkeypatch.setenv("LABCTL_EXPECTED_SIGNER", f"{BERT}; CN=Carla\\;D")
    assert verify_file(store, path, ca).expected_signers == [BERT, "CN=Carla\\;D"]
    assert not verify_file(store, path, ca).ok
    with pytest.raises(BadInput, match="the expected signer 'Ada' is no subject as RFC 4514 writes it"):
        verify_file(store, path, ca, ["Ada"])


def test_an_unsigned_file_is_by_no_expected_signer(store: Store, tmp_path: Path) -> None:
    path = issued_file(store, issue(store, SERIAL, 1, request(), AT).number, "pdf", tmp_path)
    assert verify_file(store, path, None).ok
    said = verify_file(store, path, None, [ADA])
    assert (said.ok, said.signed_by, said.in_register) == (False, None, "same")


@pytest.mark.slow
def test_a_withdrawn_certificate_is_not_to_be_relied_on(
    store: Store, tmp_path: Path, signer: Owner, authority: Owner
) -> None:
    number = issue(store, SERIAL, 1, request(), AT).number
    path, ca = issued_file(store, number, "pdf", tmp_path), tmp_path / "ca.pem"
    ca.write_bytes(authority.pem)
    assert verify_file(store, path, ca).state == "valid"
    issue(store, SERIAL, 1, request().model_copy(update={"amend": "address"}), AT)
    said = verify_file(store, path, ca)
    assert (said.ok, said.state) == (True, "amended")
    withdraw(store, WithdrawRequest(number=number, by="Rita", reason="wrong item"), AT)
    said = verify_file(store, path, ca)
    assert (said.ok, said.state, said.in_register) == (False, "withdrawn", "same")
    with open_store(str(tmp_path / "customer.sqlite"), write=True) as other:
        said = verify_file(other, path, ca)
    assert (said.ok, said.state) == (True, "unknown")


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"hello", "this is no PDF, XML or JSON file; name the file of a certificate"),
        (b"%PDF-1.7 broken", "this PDF cannot be read"),
        (b"<dcc><uniqueIdentifier>ICL-1", "this is no XML"),
    ],
)
def test_other_files_are_refused(store: Store, tmp_path: Path, content: bytes, said: str) -> None:
    (tmp_path / "file").write_bytes(content)
    with pytest.raises(BadInput, match=f"{tmp_path}/file: {said}"):
        verify_file(store, tmp_path / "file", None)
    with pytest.raises(BadInput, match="No such file"):
        verify_file(store, tmp_path / "none", None)


@pytest.mark.slow
def test_the_commands(
    with_version: Path, tmp_path: Path, signer: Owner, authority: Owner, monkeypatch: pytest.MonkeyPatch
) -> None:
    lab = Lab(tmp_path)
    copy_database(str(with_version), lab.database)
    (tmp_path / "order.toml").write_text(tomli_w.dumps(ORDER), encoding="utf-8")
    (tmp_path / "ca.pem").write_bytes(authority.pem)
    pdf = str(tmp_path / "c.pdf")
    said = lab.run("certificate", SERIAL, "--order", str(tmp_path / "order.toml"), "--out", pdf).stdout
    assert "signed by CN=Ada Authoriser,O=Lab & Sons" in said
    assert "signed by CN=Ada Authoriser" in lab.run("certificates", SERIAL).stdout
    assert lab.json("certificates", SERIAL)[0]["signed_by"]["issuer"] == "CN=Root authority,O=Lab & Sons"
    assert lab.json("certificates", "list", SERIAL) == lab.json("certificates", SERIAL)
    said = lab.run("certificates", "verify", pdf, "--ca", str(tmp_path / "ca.pem")).stdout
    assert "as it was issued, byte for byte" in said
    assert "state: valid" in said
    assert f"signed by {ADA}; any signer is accepted, because --signer names none" in said
    of_two = lab.run("certificates", "verify", pdf, "--signer", BERT, "--signer", ADA).stdout
    assert f"signed by {ADA}; expected: {BERT} or {ADA}" in of_two
    assert "NOT BY AN EXPECTED SIGNER" in lab.run("certificates", "verify", pdf, "--signer", BERT, status=1).stdout
    assert said.count("valid") >= 2
    assert "trusted: issued by CN=Root authority" in said
    assert lab.json("certificates", "verify", pdf)["ok"] is True
    (tmp_path / "c.pdf").write_bytes((tmp_path / "c.pdf").read_bytes() + b" ")
    said = lab.run("certificates", "verify", pdf, status=1).stdout
    assert "not as it was issued" in said
    assert "NOT VALID: something was added to the file after it was signed" in said
    said = lab.run("signing-key", "show").stdout
    assert f"fingerprint: {lab.json('signing-key', 'show')['fingerprint']}" in said
    issued = str(tmp_path / "issued.pdf")
    lab.run("certificate", SERIAL, "--out", issued)
    (number,) = [each["number"] for each in lab.json("certificates", SERIAL)]
    lab.run("certificate", "withdraw", number, "--by", "Rita", "--reason", "wrong item")
    said = lab.run("certificates", "verify", issued, status=1).stdout
    assert "state: withdrawn since" in said
    assert "(wrong item)" in said
    monkeypatch.delenv("LABCTL_SIGN_KEY")
    assert "LABCTL_SIGN_KEY is not set" in lab.run("signing-key", "show", status=2).stderr


def test_a_service_signs_what_is_issued_over_http(
    with_version: Path, tmp_path: Path, signer: Owner, monkeypatch: pytest.MonkeyPatch
) -> None:
    copy_database(str(with_version), tmp_path / "lab.sqlite")
    path = f"/api/units/{SERIAL}/calibrations/1/certificate"
    with open_client(tmp_path / "lab.sqlite") as client:
        answer = client.post(path, json={"by": "I. Issuer", "order": ORDER})
        assert answer.json()["signed_by"]["subject"] == "CN=Ada Authoriser,O=Lab & Sons"
        assert pdf_verifies(client.get(path).content, signer.certificate)
        assert xml_verifies(client.get(path, params={"format": "xml"}).content, signer.certificate)
        monkeypatch.setenv("LABCTL_SIGN_KEY", str(tmp_path / "gone.pem"))
        amend = client.post(path, json={"by": "I. Issuer", "amend": "address"})
        assert (amend.status_code, amend.json()["type"]) == (400, "urn:labctl:problem:bad-input")
        assert "gone.pem" in amend.json()["detail"]

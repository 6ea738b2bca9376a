"""A file of a certificate, verified: as it was issued by the register, and its signatures."""

from __future__ import annotations

import hashlib
import html
import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from labctl.answers.certificates import CertificateState, SignatoryResponse
from labctl.answers.signatures import SignatureResponse, VerifiedFileResponse
from labctl.certificates.document import TITLE, Signatory
from labctl.certificates.signing import libraries
from labctl.config import SIGNER_VARIABLE, variable
from labctl.errors import BadInput
from labctl.services.certificates.served import CertificateFormat
from labctl.services.certificates.states import certificate_by_number
from labctl.store import Store

if TYPE_CHECKING:
    from labctl.certificates.signing.verification import SignatureFound

#: The form of the signature over a file itself.
OWN = {"pdf": "PAdES", "xml": "XAdES"}
#: A number that a laboratory can have has at most so many characters.
MAX_DIGITS = 100
#: Where a file states its number: in the metadata of a PDF, which are readable in PDF/A, and in a DCC. The last counts.
_NUMBER = {
    "pdf": re.compile(rb"<rdf:li[^>]*>" + TITLE.encode() + rb" ([^<]+)</rdf:li>"),
    "xml": re.compile(rb"<(?:\w+:)?uniqueIdentifier>([^<]+)<"),
}


def verify_file(store: Store, path: Path, ca: Path | None, signers: Sequence[str] = ()) -> VerifiedFileResponse:
    """Verify a PDF, DCC or JSON file; `ca`: the authorities that are trusted, in PEM form.

    `signers` are expected to have signed it, one of them: subjects as RFC 4514 writes them, or fingerprints. Without
    any, those that the environment names. Raises BadInput.
    """
    expected = [*signers] or expected_signers()
    if expected:
        with libraries("the verification of signatures"):
            from labctl.certificates.signing.expected import refuse_unreadable  # noqa: PLC0415  only where one is named
        refuse_unreadable(expected)
    try:
        content = path.read_bytes()
    except OSError as error:
        raise BadInput(f"{path}: {error.strerror}; name the file of a certificate") from error
    form = _format_of(content, path)
    number = _number_in(content, form)
    row = None if number is None else store.certificates.of_number(number)
    in_register: Literal["same", "differs", "unknown"] = "unknown"
    if row is not None:
        forms = store.certificates.forms(row.number)
        stored = {"pdf": forms.pdf, "xml": forms.xml, "json": forms.document}[form]
        in_register = "same" if stored == content else "differs"
    signatures = _signatures(content, form, path, ca)
    answers = [_answer(signature, expected) for signature in signatures]
    certificate = None if row is None else certificate_by_number(store, row.number)
    # a DCC that is attached to a PDF is signed by itself, which says nothing of the pages
    from_labctl = [answer for answer in answers if answer.valid and answer.form == OWN.get(form)]
    by = [each.signed_by for each in from_labctl]
    if form == "json" and certificate is not None and in_register == "same":
        by = [certificate.signed_by]
    against = in_register == "differs" or not all(answer.valid for answer in answers)
    against = against or any(answer.trust == "not trusted" or answer.expected is False for answer in answers)
    against = against or (bool(expected) and not any(_is_one_of(each, expected) for each in by))
    vouched = in_register == "same" or any(each.trust == "trusted" for each in from_labctl)
    state: CertificateState | Literal["unknown"] = "unknown" if certificate is None else certificate.state
    return VerifiedFileResponse(
        format=form,
        sha256=hashlib.sha256(content).hexdigest(),
        number=number,
        in_register=in_register,
        certificate=certificate,
        state=state,
        signed_by=next(iter(by), None),
        expected_signers=expected,
        signatures=answers,
        ok=vouched and not against and state != "withdrawn",
    )


def expected_signers() -> list[str]:
    """Return the signers that the environment names as expected, separated by semicolons; empty: any is accepted."""
    return [each.strip() for each in re.split(r"(?<!\\);", variable(SIGNER_VARIABLE)) if each.strip()]


def _is_one_of(signer: SignatoryResponse | None, wanted: Sequence[str]) -> bool:
    if signer is None:
        return False
    with libraries("the verification of signatures"):
        from labctl.certificates.signing.expected import is_expected  # noqa: PLC0415  only where one is expected
    return is_expected(Signatory(**signer.model_dump()), wanted)


def _format_of(content: bytes, path: Path) -> CertificateFormat:
    start = content.lstrip(b"\xef\xbb\xbf \r\n\t")[:5]
    if start.startswith(b"%PDF"):
        return "pdf"
    if start.startswith(b"<"):
        return "xml"
    if start.startswith(b"{"):
        return "json"
    raise BadInput(f"{path}: this is no PDF, XML or JSON file; name the file of a certificate as it was issued")


def _number_in(content: bytes, form: CertificateFormat) -> str | None:
    """Return the number that a file states, whatever else is wrong with it."""
    try:
        if form == "json":
            number = str(json.loads(content)["number"])
        else:
            numbers = _NUMBER[form].findall(content)
            number = html.unescape(numbers[-1].decode()) if numbers else ""
        return number if 0 < len(number) <= MAX_DIGITS and number.isprintable() else None
    except (ValueError, KeyError, TypeError, RecursionError):
        return None


def _signatures(content: bytes, form: CertificateFormat, path: Path, ca: Path | None) -> list[SignatureFound]:
    if form == "json":  # its hash is in the register; it has no signature of its own
        return []
    with libraries("the verification of signatures"):
        from labctl.certificates.signing import verification  # noqa: PLC0415  only where one is verified
        from labctl.certificates.signing.keys import read_certificates  # noqa: PLC0415  as above
    roots = None if ca is None else read_certificates(ca)
    try:
        look = verification.signatures_of_pdf if form == "pdf" else verification.signatures_of_dcc
        return look(content, roots)
    except BadInput as error:
        raise BadInput(f"{path}: {error}") from error
    except Exception as error:  # a damaged file makes the libraries raise errors of many kinds
        raise BadInput(
            f"{path}: its signature cannot be read ({type(error).__name__}: {error}); give the file as it was issued"
        ) from error


def _answer(signature: SignatureFound, wanted: Sequence[str]) -> SignatureResponse:
    signer = None if signature.signatory is None else SignatoryResponse.model_validate(signature.signatory.model_dump())
    return SignatureResponse(
        form=signature.form,
        valid=signature.valid,
        problem=signature.problem,
        signed_by=signer,
        signed_at=signature.signed_at,
        trust=signature.trust,
        reason=signature.reason,
        expected=_is_one_of(signer, wanted) if wanted else None,
    )

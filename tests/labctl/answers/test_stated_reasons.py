"""The reason for an act is in words, where an act needs one; an abort is not refused for its reason."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import ValidationError

from labctl.answers.base import Request
from labctl.answers.campaigns import ReasonRequest
from labctl.answers.certificates import CertificateRequest, WithdrawRequest
from labctl.answers.certification import CertifyRequest, ReleaseRequest, RevokeRequest
from labctl.answers.standards import StandardBadRequest, WithdrawFindingRequest
from labctl.answers.validity import CheckGyroRequest

#: Requests that state a reason, what else they need, and the field of the reason.
STATED: dict[type[Request], tuple[dict[str, Any], str]] = {
    CertifyRequest: ({}, "reason"), RevokeRequest: ({}, "reason"), ReleaseRequest: ({}, "reason"),
    WithdrawRequest: ({"number": "ICL-2027-0001"}, "reason"), CertificateRequest: ({}, "amend"),
    StandardBadRequest: ({"bad_from": "2027-01-05"}, "reason"), WithdrawFindingRequest: ({}, "reason"),
    CheckGyroRequest: ({}, "reason"),
}  # fmt: skip


@pytest.mark.parametrize("kind", STATED)
@pytest.mark.parametrize("blank", ["   ", "\u200b", "\u00a0 "])
def test_a_blank_reason_is_refused(kind: type[Request], blank: str) -> None:
    given, name = STATED[kind]
    with pytest.raises(ValidationError, match="the reason is blank; state in words why") as refused:
        kind(by="Ada", **given, **{name: blank})
    assert [each["loc"] for each in refused.value.errors()] == [(name,)]


@pytest.mark.parametrize("kind", STATED)
def test_a_reason_is_kept_as_typed(kind: type[Request]) -> None:
    given, name = STATED[kind]
    assert kind(by="Ada", **given, **{name: " scale factor "}).model_dump()[name] == " scale factor "


def test_an_abort_takes_a_blank_reason() -> None:
    assert ReasonRequest(reason="  ", by="Ada").reason == "  "

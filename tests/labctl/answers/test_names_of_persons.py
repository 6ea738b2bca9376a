"""The name of a person in a request: it is stated, short, and without spaces around it."""

from __future__ import annotations

import inspect
import re
from pathlib import Path
from typing import Any

import pytest
from pydantic import BaseModel, ValidationError

from labctl import answers
from labctl.answers.base import Request
from labctl.answers.benches import ClearRequest
from labctl.answers.campaigns import ReasonRequest, ResumeRequest
from labctl.answers.certificates import WithdrawRequest
from labctl.answers.certification import CertificationResponse, CertifyRequest, ReleaseRequest, RevokeRequest
from labctl.answers.common_fields import MAX_PERSON_CHARACTERS
from labctl.answers.fleet import FleetCancelRequest

#: The requests that tests below fill in, and what they need beside `by`.
FILLED: dict[type[Request], dict[str, Any]] = {
    CertifyRequest: {"reason": "r"}, RevokeRequest: {"reason": "r"}, ReleaseRequest: {"reason": "r"},
    ClearRequest: {}, ResumeRequest: {}, WithdrawRequest: {"number": "ICL-2027-0001", "reason": "r"},
}  # fmt: skip


@pytest.mark.parametrize("kind", FILLED)
@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("", r"blank \(0 characters\); give a name of 1 to 120"),
        ("   ", r"blank \(3 characters\); give a name of 1 to 120"),
        ("\u200b", "blank"),
        ("x" * 5000, r"has 5000 characters, at most 120 are allowed; shorten it"),
    ],
)
def test_a_name_that_is_none_or_too_long_is_refused(kind: type[Request], name: str, message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        kind(by=name, **FILLED[kind])


@pytest.mark.parametrize("kind", FILLED)
def test_spaces_around_a_name_are_removed(kind: type[Request]) -> None:
    longest = "x" * MAX_PERSON_CHARACTERS
    assert [kind(by=f"  {name} ", **FILLED[kind]).model_dump()["by"] for name in ("A. B", longest)] == ["A. B", longest]


@pytest.mark.parametrize("kind", [ReasonRequest, FleetCancelRequest])
def test_no_end_of_a_campaign_or_a_job_is_refused_for_the_length_of_a_name(kind: type[Request]) -> None:
    assert [kind(by=by, reason="r").model_dump()["by"] for by in ("   ", " A ", "x" * 5000)] == ["", "A", "x" * 120]


def test_every_request_bounds_the_name_of_a_person() -> None:
    found = [getattr(answers, name) for name in dir(answers)]
    requests = [each for each in found if inspect.isclass(each) and issubclass(each, Request)]
    named = [(each, name) for each in requests for name in ("by", "confirmed_by") if name in each.model_fields]
    assert len(named) > 15
    for request, name in named:
        functions = {getattr(each, "func", None) for each in request.model_fields[name].metadata}
        inner = str(request.model_fields[name].annotation)
        assert any(function is not None for function in functions) or "AfterValidator" in inner, (request, name)


def test_a_longer_name_that_was_stored_is_read() -> None:
    stored = {
        "serial": "A", "version": 1, "act": "certify", "by": "x" * 5000, "reason": "r", "at": "2027-03-01T00:00:00Z",
    }  # fmt: skip
    assert len(CertificationResponse.model_validate(stored).by) == 5000
    assert issubclass(CertificationResponse, BaseModel)


@pytest.mark.parametrize("days", [-5, 99_999_999])
def test_a_due_date_beyond_the_limits_is_refused_in_words(days: int) -> None:
    with pytest.raises(ValidationError, match=rf"cannot be due in {days} days; give from 1 to 36500 days, or 0 for no"):
        CertifyRequest(by="A", reason="r", due_days=days)


def test_the_pages_take_and_show_names_of_the_same_length() -> None:
    pages = Path("labctl/web/static/js/core")
    stated = [
        int(number)
        for file in pages.rglob("*.js")
        for number in re.findall(r"MAX_PERSON_CHARACTERS = (\d+)", file.read_text(encoding="utf-8"))
    ]
    assert stated == [MAX_PERSON_CHARACTERS]

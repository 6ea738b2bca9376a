"""A version in force that is certified again: the same act on one day is written once, any other one in addition."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import timedelta
from pathlib import Path

import pytest

from labctl.answers.certificates import WithdrawRequest
from labctl.answers.certification import CertificationResponse, CertifyRequest
from labctl.services.calibrations.assessment import assess
from labctl.services.calibrations.certification import certify, list_certifications
from labctl.services.certificates.issue import issue, withdraw
from labctl.store import Store, open_store
from tests.helpers.certificates import AT, SERIAL, add_version, request

pytestmark = pytest.mark.usefixtures("shared_answers")
ASKED = CertifyRequest(by="Ada A.", reason="meets the criteria of LAB-P-012, looked at by hand", override=True)
MINUTE, DAY = timedelta(minutes=1), timedelta(days=1)


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as opened:
        add_version(opened, certified=False)
        yield opened


def again(store: Store, after: timedelta, asked: CertifyRequest = ASKED) -> str | None:
    answer = certify(store, SERIAL, 1, asked, AT + after)
    assert isinstance(answer, CertificationResponse)
    return answer.already_in_force


def test_the_same_act_of_one_day_is_written_once(store: Store) -> None:
    assert assess(store, SERIAL, 1).in_force is False
    assert [again(store, 0 * MINUTE), again(store, MINUTE)] == [None, "unchanged"]
    assert assess(store, SERIAL, 1).in_force is True
    assert len(list_certifications(store, SERIAL)) == 1
    assert again(store, 2 * MINUTE, ASKED.model_copy(update={"by": "Bob B."})) == "renewed"
    assert again(store, 3 * MINUTE) == "renewed"
    assert again(store, 4 * MINUTE, ASKED.model_copy(update={"due_days": 30})) == "renewed"
    assert len(list_certifications(store, SERIAL)) == 4


def test_the_same_act_of_another_day_or_after_a_withdrawal_is_written(store: Store) -> None:
    again(store, 0 * MINUTE)
    assert again(store, DAY) == "renewed"
    number = issue(store, SERIAL, 1, request(), AT + DAY + MINUTE).number
    withdraw(store, WithdrawRequest(number=number, by="Ada A.", reason="wrong"), AT + DAY + 2 * MINUTE)
    assert again(store, DAY + 3 * MINUTE) == "renewed"
    assert again(store, DAY + 4 * MINUTE) == "unchanged"
    assert len(list_certifications(store, SERIAL)) == 3

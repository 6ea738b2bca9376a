"""Every call of the bench process: what is given and what is answered arrives as it was, made by hypothesis from types."""

from __future__ import annotations

import inspect
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, get_type_hints

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pydantic import JsonValue

from labctl.processes.bench_forms import Beat, form_of
from labctl.processes.call_forms import CallForm, read_call
from labctl.processes.documents import answer, value_of
from labctl.processes.settings import BenchSettings
from labctl.services.commands.acts.catalogue import BENCH_ACTS
from labctl.services.commands.requests import CampaignResume, CampaignStart, ToBench, ToCampaign
from labctl.services.schemas.base import Request
from labctl.services.schemas.benches import CheckRequest
from labctl.services.schemas.campaigns import CampaignRequest, ConfirmRequest, ReasonRequest, ResumeRequest
from labctl.services.schemas.live import LiveEndRequest, LiveRequest
from labctl.store.connection.transactions import TRANSACTIONS

AT = datetime(2026, 1, 5, 8, 0, 0, 123456, tzinfo=UTC)
JSON = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**53), 2**53) | st.floats() | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=5,
)
DOCUMENTS = st.dictionaries(st.text(), JSON, max_size=3)


def of(kind: Any) -> st.SearchStrategy[Any]:
    """Values of a type; those that JSON documents and dates are made of as JSON and labctl have them."""
    st.register_type_strategy(datetime, st.datetimes(timezones=st.just(UTC)))
    if kind == Mapping[str, object] or kind == Mapping[str, JsonValue]:
        return DOCUMENTS
    return st.from_type(kind)


def same(found: object, given: object) -> bool:
    """Whether two values are equal and of the same types, numbers that are none included."""
    if isinstance(given, float):
        return type(found) is float and (found == given or (found != found and given != given))
    if isinstance(given, Mapping):
        return isinstance(found, Mapping) and found.keys() == given.keys() and all(same(found[k], given[k]) for k in given)
    if isinstance(given, Sequence) and not isinstance(given, str | bytes):
        return isinstance(found, Sequence) and len(found) == len(given) and all(map(same, found, given))
    if hasattr(given, "__dict__") and not isinstance(given, type):
        return type(found) is type(given) and same(vars(found), vars(given))
    return type(found) is type(given) and found == given


def carried(form: CallForm, *args: object) -> list[object]:
    call, found = read_call(form.call(*args), form_of)
    assert (call.name, found) == (form.name, form)
    return [*call.arguments.values()]


@pytest.mark.parametrize("name", sorted(TRANSACTIONS))
@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])
@given(data=st.data())
def test_every_transaction_gets_what_was_given(name: str, data: st.DataObject) -> None:
    method = inspect.unwrap(TRANSACTIONS[name])
    hints = get_type_hints(method, include_extras=True)
    form = form_of(f"store.{name}")
    result = data.draw(of(hints.pop("return")))
    args = [data.draw(of(kind)) for kind in hints.values()]
    if args:
        kwargs = dict(zip(hints, args, strict=True))
        call, _ = read_call(form.call(**kwargs), form_of)
        assert same(dict(call.arguments), kwargs)
    assert same(value_of(form.result, answer(form.result, result)), result)

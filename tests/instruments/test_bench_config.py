"""Bench files: what cannot be a bench is refused when it is read."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import ValidationError

from instruments.bench_config import BenchFile, read_bench


def two_units(**second: Any) -> dict[str, Any]:
    bench = read_bench("single-axis-sim").model_dump(exclude_none=True)
    (unit,) = bench["gyros"]
    other = {"name": "other", "serial": "FOG-0002", "port": "sim://other"}
    return {**bench, "gyros": [unit, {**unit, **other, **second}]}


def test_two_units_may_share_a_bench() -> None:
    assert len(BenchFile.model_validate(two_units()).gyros) == 2


@pytest.mark.parametrize("what", ["name", "serial", "port"])
def test_two_units_are_never_taken_for_one(what: str) -> None:
    same = two_units()["gyros"][0][what]
    with pytest.raises(ValidationError, match=f"two gyros have the {what} '{same}'; each needs its own"):
        BenchFile.model_validate(two_units(**{what: same}))

"""The public API: what each public module exports, with its signatures, is held in public_api.json."""

from __future__ import annotations

import importlib
import inspect
import json

import pytest

from tests.helpers.paths import ROOT
from tests.helpers.public_api import FILE, MODULES, members, public_api

WRITE = "if the change is wanted: python -m tests.helpers.public_api, and a line in CHANGELOG.md"


def test_names_and_signatures_are_as_they_are_written_down() -> None:
    assert public_api() == json.loads(FILE.read_text(encoding="utf-8")), WRITE


@pytest.mark.parametrize("name", MODULES)
def test_a_public_module_exports_what_it_names_and_says_what_that_is(name: str) -> None:
    module = importlib.import_module(name)
    assert inspect.getdoc(module)
    assert sorted(set(module.__all__)) == sorted(module.__all__)
    described = [
        each for each in module.__all__ if inspect.isfunction(value := getattr(module, each)) or inspect.isclass(value)
    ]
    assert described
    assert not [each for each in described if not inspect.getdoc(getattr(module, each))]


def test_types_of_the_packages_are_seen_by_a_type_checker_of_the_caller() -> None:
    assert all((ROOT / package / "py.typed").is_file() for package in ("instruments", "procedures", "labctl"))


def test_a_changed_signature_is_seen() -> None:
    class Before:
        def turn(self, rate_dps: float) -> None:
            """Turn."""

    class After:
        def turn(self, rate_dps: float, *, slowly: bool = False) -> None:
            """Turn."""

    Before.__module__ = After.__module__ = "labctl.example"
    assert members(Before) != members(After)
    assert members(After)["turn"] == "(self, rate_dps: 'float', *, slowly: 'bool' = False) -> 'None'"

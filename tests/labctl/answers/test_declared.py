"""Everything that answers is declared: no response has a key, or a value, whose type is not written down."""

from __future__ import annotations

import importlib
import json
import pkgutil
from collections.abc import Iterator
from types import ModuleType
from typing import Any

import pytest
from pydantic import BaseModel, TypeAdapter, ValidationError
from typing_extensions import get_type_hints, is_typeddict

import labctl.answers
from labctl.answers.base import ResponseModel
from labctl.answers.calibrations import FitResponse, ImprovedVersionResponse, VersionResponse
from labctl.services.commands.registry import COMMANDS
from labctl.store import open_store
from tests.helpers.annotations import mentions_any
from tests.helpers.lab import Lab
from tests.helpers.paths import EXAMPLES

FOG = "OSU-FOG-2024"


def modules(package: ModuleType) -> Iterator[ModuleType]:
    for found in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
        yield importlib.import_module(found.name)


def declared(package: ModuleType) -> set[type]:
    """Return the models and typed dictionaries of a package."""
    found = {value for module in modules(package) for value in vars(module).values() if isinstance(value, type)}
    own = {each for each in found if each.__module__.startswith("labctl.")}
    return {each for each in own if is_typeddict(each) or issubclass(each, BaseModel)}


def loose(kind: type) -> list[str]:
    """Return the fields of a model or typed dictionary whose type has Any inside."""
    if issubclass(kind, BaseModel):
        return [name for name, field in kind.model_fields.items() if mentions_any(field.annotation)]
    return [name for name, hint in get_type_hints(kind).items() if mentions_any(hint)]


def test_no_field_of_a_request_or_response_is_any() -> None:
    kinds = declared(labctl.answers)
    assert len(kinds) > 100
    assert not {kind.__name__: loose(kind) for kind in kinds if loose(kind)}


def test_each_request_and_answer_has_one_declaration_and_the_package_offers_it_by_name() -> None:
    own = [kind for kind in declared(labctl.answers) if kind.__module__.startswith("labctl.answers.")]
    named: dict[str, type] = {kind.__name__: kind for kind in own}
    assert len(named) == len(own), sorted(kind.__name__ for kind in own)
    assert {name: getattr(labctl.answers, name) for name in named} == named


def test_a_field_that_is_any_is_seen() -> None:
    class Loose(ResponseModel):
        fixed: list[int]
        anything: dict[str, list[Any]]

    assert "anything" in loose(Loose)
    assert "fixed" not in loose(Loose)


def test_no_response_lets_undeclared_keys_through() -> None:
    responses = {kind for kind in declared(labctl.answers) if issubclass(kind, ResponseModel)}
    open_ones = {kind.__name__ for kind in responses if kind.model_config.get("extra") == "allow"}
    assert len(responses) > 60
    assert not open_ones


def test_every_command_answers_with_a_model() -> None:
    assert all(issubclass(kind, ResponseModel) for command in COMMANDS for kind in command.responses.values())


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Lab:
    lab = Lab(tmp_path_factory.mktemp("declared"))
    lab.run("import", str(EXAMPLES / "osu-fog"))
    lab.run("fit", FOG, "--effects", "bias,scale_factor")
    lab.run("improve", FOG, "--add", "scale_factor_asymmetry")
    return lab


@pytest.mark.slow
def test_every_key_that_is_kept_with_a_version_is_declared(lab: Lab) -> None:
    with open_store(str(lab.database), write=False) as store:
        first, second = (store.calibrations.get(FOG, version).answer for version in (1, 2))
    assert set(first) <= set(VersionResponse.model_fields)
    assert set(second) <= set(ImprovedVersionResponse.model_fields)
    assert set(first["model"]) == {"name", "effects", "argument", "terms", "temperature", "reference"}


def test_an_answer_with_an_undeclared_key_is_not_made(lab: Lab) -> None:
    with open_store(str(lab.database), write=False) as store:
        kept = dict(store.calibrations.get(FOG, 1).answer)
    assert FitResponse.model_validate(kept, extra="forbid").version == 1
    with pytest.raises(ValidationError, match="surprise"):
        FitResponse.model_validate({**kept, "surprise": 1}, extra="forbid")


@pytest.mark.slow
def test_a_document_survives_its_declaration(lab: Lab) -> None:
    """What a criticism prints is what its model reads back: no key is dropped, no number changes its kind."""
    from labctl.answers.criticism import CriticismResponse

    printed = lab.run("criticise", FOG, "--json").stdout
    document = json.loads(printed)
    again = TypeAdapter(CriticismResponse).validate_json(printed).model_dump(mode="json")
    assert again == document
    assert document["views"]["channels"][0].keys() >= {"axis", "channel", "at", "mean_dps", "low_dps", "high_dps", "z"}

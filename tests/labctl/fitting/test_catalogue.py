"""The catalogue of effects: labctl's own, and those of other packages that can be fitted."""

from __future__ import annotations

import pickle
from typing import Any, ClassVar

import numpy as np
import pytest

from instruments.plugins import PluginError
from labctl.errors import BadInput
from labctl.fitting.effects import CATALOGUE, Column, Effect, Term, catalogue, effect, families
from labctl.fitting.effects.bias import Bias
from labctl.fitting.effects.catalogue import EFFECTS
from tests.helpers.plugins import register


class Torsion(Effect):
    """An effect of another package."""

    id = "cable_torsion"
    term = "Cable torsion"
    sentence = "The cable twists."
    origin: ClassVar[Any] = "fixture"
    rows: ClassVar[Any] = "all"

    def columns(self, channels: Any, axis: str, term: Any, reference: Any) -> list[Column]:
        return [Column("torsion", "deg/s", np.ones(len(channels)))]


class Short(Torsion):
    def columns(self, channels: Any, axis: str, term: Any, reference: Any) -> list[Column]:
        return [Column("torsion", "deg/s", np.ones(2))]


class Failing(Torsion):
    def columns(self, channels: Any, axis: str, term: Any, reference: Any) -> list[Column]:
        raise KeyError("angle")


class Silent(Torsion):
    sentence = ""


class Misnamed(Torsion):
    id = "Cable Torsion"


@pytest.fixture(autouse=True)
def _fresh_catalogue(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(catalogue, "_all", catalogue._all.__wrapped__)


def test_labctls_own_effects_keep_their_order() -> None:
    assert list(CATALOGUE) == [kind.id for kind in EFFECTS]
    assert len(CATALOGUE) == len(EFFECTS)
    assert set(pickle.loads(pickle.dumps(CATALOGUE))) == set(CATALOGUE)
    assert [own.id for own in families._checked(EFFECTS)] == list(
        CATALOGUE
    )  # each can be fitted, as others' have to be


def test_an_effect_of_another_package_comes_last(monkeypatch: pytest.MonkeyPatch) -> None:
    register(monkeypatch, families.FAMILIES, "torsion", families._checked(Torsion))
    assert list(CATALOGUE)[-1] == "cable_torsion"
    assert effect("cable_torsion").term == "Cable torsion"
    assert CATALOGUE["bias"].id == "bias"


@pytest.mark.parametrize(
    ("kind", "error"),
    [
        (Short, r"ValueError.*shape \(2,\) for 6 data sets"),
        (Failing, "KeyError.*angle"),
        (Silent, "TypeError.*does not define sentence"),
        (Misnamed, "ValueError.*'Cable Torsion' is not valid; use small letters"),
        (Term, "TypeError.*is not a subclass of"),
        (7, "TypeError"),
    ],
)
def test_one_that_cannot_be_fitted_is_left_out_with_one_line(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, kind: Any, error: str
) -> None:
    plugin = register(monkeypatch, families.FAMILIES, "torsion", None)
    monkeypatch.setattr(type(plugin), "load", lambda _: kind)
    del families.FAMILIES._loaded["torsion"]
    with pytest.raises(PluginError, match=error):
        families.FAMILIES.get("torsion")
    assert list(CATALOGUE) == [own.id for own in EFFECTS]
    (record,) = caplog.records
    assert "entry point 'torsion' (acme:torsion) of acme-plugins 0.3" in record.getMessage()


def test_an_id_of_labctls_own_is_not_taken(monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture) -> None:
    class Other(Torsion):
        id = "bias"

    register(monkeypatch, families.FAMILIES, "torsion", families._checked((Other, Torsion)))
    assert isinstance(dict(CATALOGUE.items())["bias"], Bias)
    assert "cable_torsion" in CATALOGUE
    (record,) = caplog.records
    assert "effect 'bias' is left out: labctl " in record.getMessage()


def test_an_unknown_effect_is_told_where_effects_come_from() -> None:
    with pytest.raises(BadInput, match="not in the catalogue; `labctl effects` lists them, and a package may bring it"):
        effect("xyzzy_of_acme")

"""TOML from an unknown source: nested, long and odd texts end in one line, in time."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from instruments.toml_documents import DEEPEST, MAX_BYTES, listed, parse_toml, read_toml, shown
from labctl.errors import BadBench, BadInput
from labctl.fitting.effects import formulas
from labctl.services.planning.loading import load_bench, own_text
from procedures.contracts.errors import RecipeError
from procedures.recipe.recipe import parse_recipe

DEEP = 100_000
NESTED = {
    "arrays": "name = " + "[" * DEEP + "]" * DEEP,
    "tables": "name = " + "{a = " * DEEP + "1" + "}" * DEEP,
    "dotted key": "a." * DEEP + "a = 1",
    "dotted header": "[" + "a." * DEEP + "a]",
    "quoted header": "[" + "'a' . " * DEEP + "a]",
}


@pytest.mark.timeout(10)  # the parser alone takes 13 s of 100,000 parts and ends in a RecursionError of 40
@pytest.mark.parametrize("text", NESTED.values(), ids=NESTED)
def test_what_is_nested_too_deeply_is_refused_before_it_is_parsed(text: str, tmp_path: Path) -> None:
    text = f'format = "x"\n{text}\n'
    with pytest.raises(tomllib.TOMLDecodeError, match=f"line 2: .* more than {DEEPEST} levels deep"):
        parse_toml(text)
    file = tmp_path / "deep.toml"
    file.write_text(text)
    with pytest.raises(RecipeError, match=r"recipe: not TOML: line 2: .* deep"):
        parse_recipe(text)
    with pytest.raises(RecipeError, match=r"deep\.toml: not TOML: line 2: .* deep"):
        own_text(str(file))
    with pytest.raises(BadBench, match=r"deep\.toml: not TOML: line 2: .* deep"):
        load_bench(str(file))
    with pytest.raises(BadInput, match=r"deep\.toml: line 2: .* deep"):
        formulas(str(file))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a = " + "1" * 5000, "4300 digits"),
        ("a = 2026-02-30", "date"),
        ("a = 1\na = 2", "overwrite"),
        ("a = '" + "x" * MAX_BYTES + "'", f"is {MAX_BYTES} characters"),
    ],
)
def test_what_is_no_toml_is_said(text: str, said: str) -> None:
    with pytest.raises(tomllib.TOMLDecodeError, match=said):
        parse_toml(text)


def test_a_file_is_read_up_to_its_bound(tmp_path: Path) -> None:
    file = tmp_path / "long.toml"
    file.write_bytes(b"#" * (MAX_BYTES + 1))
    with pytest.raises(tomllib.TOMLDecodeError, match=f"larger than {MAX_BYTES} bytes"):
        read_toml(file)
    with pytest.raises(RecipeError, match=f"larger than {MAX_BYTES} bytes"):
        own_text(str(file))


@pytest.mark.parametrize(
    "text",
    [
        "a = [" + "1.5, " * 1000 + "]",
        "\n".join(f"[[a.b.c]]\nd = [[{n}.5], {{e = 1}}]" for n in range(100)),
        "a = '[[[" + "[" * 100 + "' # " + "{" * 100,
        'a = """\n' + "[" * 100 + ' "" \\""" ' + "{" * 100 + '"""',
        "a = '''" + "x.y" * 100 + "'''\nb = \"" + '\\"[' * 100 + '"',
        "t = 2026-01-05T08:00:00.123Z\n[" + ".".join("abcdefghijklmnopqrstuvwxyz") + "]",
    ],
)
def test_what_only_looks_deep_is_read(text: str) -> None:
    assert parse_toml(text) == tomllib.loads(text)


def test_messages_stay_short() -> None:
    assert shown("short") == "'short'"
    assert shown([1, 2]) == "[1, 2]"
    assert len(shown("x" * 10_000)) < 100
    assert len(shown([["y" * 1000] * 1000] * 1000)) < 1000
    assert listed(f"c{n}" for n in range(7)) == "c0; c1; c2; c3; c4; and 2 more"
    with pytest.raises(RecipeError) as caught:
        parse_recipe(f'name = "x"\ntemperatures_c = {["a" * 1000] * 1000}\n{"k" * 10_000} = 1\n')
    assert len(str(caught.value)) < 1500

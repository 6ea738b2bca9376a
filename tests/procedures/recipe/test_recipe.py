"""Recipes: what ships is what the papers say, and what is wrong is said in one line."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from procedures.contracts.errors import RecipeError
from procedures.recipe.recipe import Recipe, parse_recipe, read_recipe, shipped_recipes

GOOD = 'name = "a"\ntemperatures_c = [20]\nrates_dps = [0, 10]\npositions = ["z"]\n'


def test_shipped_recipes_are_listed() -> None:
    assert set(shipped_recipes()) >= {
        "table1-x-table2",
        "yang-23-rates",
        "ojeda2000",
        "ojeda2000-121",
        "gyrostar",
        "informative",
        "short",
        "sweeps",
        "by-hand",
    }


@pytest.mark.parametrize("name", shipped_recipes())
def test_a_shipped_recipe_is_named_like_its_file_and_says_what_it_is(name: str) -> None:
    recipe = read_recipe(name)
    assert recipe.name == name
    assert len(recipe.description) > 20


def test_tables_1_and_2_are_as_printed() -> None:
    recipe = read_recipe("table1-x-table2")
    assert recipe.temperatures_c == (-40, -30, -20, -10, 0, 10, 20, 30, 40, 50)
    assert sorted(set(map(abs, recipe.rates_dps))) == [0, 0.1, 1, 10, 50, 100, 150, 200, 250, 300, 400]
    assert len(recipe.rates_dps) == len(set(recipe.rates_dps)) == 21
    assert sorted(recipe.rates_dps) == sorted(-rate for rate in recipe.rates_dps)
    assert recipe.positions == ("x", "y", "z")
    assert (recipe.soak.hold_s, recipe.acquire.duration_s) == (3600, 60)
    assert (recipe.order, recipe.acquire.whole_turns_above_dps) == ("position-major", None)


def test_the_23_rates_explain_the_printed_cross_axis_errors_and_the_21_do_not() -> None:
    def rms_dps(name: str) -> float:
        rates = read_recipe(name).rates_dps
        return math.sqrt(sum(rate**2 for rate in rates) / len(rates))

    for printed_dps, misalignment in ((3.9339, 0.0187), (3.9576, 0.0188)):
        assert rms_dps("yang-23-rates") * misalignment == pytest.approx(printed_dps, rel=2e-3)
        assert abs(rms_dps("table1-x-table2") * misalignment / printed_dps - 1) > 0.08


def test_ojeda_has_every_ten_degrees_and_every_two_kelvin() -> None:
    recipe = read_recipe("ojeda2000")
    assert recipe.rates_dps == tuple(range(-100, 101, 10))
    assert recipe.temperatures_c == tuple(range(25, 46, 2))
    paper = read_recipe("ojeda2000-121")
    assert len(paper.rates_dps) * len(paper.temperatures_c) == 121


def test_the_gyrostar_stays_within_its_data_sheet() -> None:
    recipe = read_recipe("gyrostar")
    assert max(map(abs, recipe.rates_dps)) == 90
    assert (min(recipe.temperatures_c), max(recipe.temperatures_c)) == (16, 45)


def test_a_file_is_read_by_path(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(GOOD, encoding="utf-8")
    assert read_recipe(path).rates_dps == (0, 10)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (GOOD + "raets_dps = [1]\n", ["'raets_dps'", "did you mean 'rates_dps'"]),
        (GOOD + "[soak]\nhold = 1\n", ["'soak.hold'", "did you mean 'hold_s'"]),
        (GOOD + "[inverted]\nrates_dps = [0]\n", ["'inverted.temperatures_c' is missing"]),
        (GOOD + "[inverted]\nrate_dps = [0]\ntemperatures_c = [1]\n", ["did you mean 'rates_dps'"]),
        ('name = "a"\n', ["'temperatures_c' is missing", "'rates_dps' is missing"]),
        (GOOD.replace("[20]", '["20"]'), ["temperatures_c.0", "'20'"]),
        (GOOD.replace("[20]", "[nan]"), ["temperatures_c.0", "finite"]),
        (GOOD.replace("[20]", "[inf]"), ["temperatures_c.0", "finite"]),
        (GOOD.replace("[20]", "[true]"), ["temperatures_c.0", "True"]),
        (GOOD.replace("[20]", "[]"), ["temperatures_c", "at least 1"]),
        (GOOD.replace('"z"', '"up"'), ["positions.0", "'up'"]),
        (GOOD + "[soak]\nhold_s = -1\n", ["soak.hold_s", "greater than or equal to 0", "-1"]),
        (GOOD + 'repeats = "2"\n', ["repeats", "'2'"]),
        (GOOD + "[guards.actions]\nrates = 'fail'\n", ["guards.actions.rates"]),
        (GOOD + 'format = "labctl-recipe/2"\n', ["format", "labctl-recipe/1"]),
        ("rates_dps = [", ["not TOML"]),
    ],
)
def test_what_is_wrong_is_said_in_one_line(text: str, words: list[str]) -> None:
    with pytest.raises(RecipeError) as caught:
        parse_recipe(text, source="mine.toml")
    message = str(caught.value)
    assert message.startswith("mine.toml: ")
    assert "\n" not in message
    for word in words:
        assert word in message


def test_an_unknown_name_lists_what_ships() -> None:
    with pytest.raises(RecipeError, match=r"no recipe 'tabel1'.*table1-x-table2"):
        read_recipe("tabel1")


def test_a_folder_and_a_binary_file_are_no_recipes(tmp_path: Path) -> None:
    with pytest.raises(RecipeError, match="cannot be read"):
        read_recipe(tmp_path)
    (tmp_path / "x.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(RecipeError, match="cannot be read"):
        read_recipe(tmp_path / "x.toml")


def by_hand(more: str = "turns_deg = [360]", top: str = "") -> str:
    return f'name = "h"\npositions = ["x", "-y"]\n{top}\n[turns]\n{more}\n'


def test_a_recipe_of_turns_has_neither_rates_nor_temperatures() -> None:
    recipe = parse_recipe(by_hand())
    assert (recipe.rates_dps, recipe.temperatures_c) == ((), ())
    assert recipe.turns is not None
    assert (recipe.turns.u_deg, recipe.turns.within_s, recipe.turns.tolerance) == (1.0, 300.0, 0.1)
    assert Recipe.model_validate(recipe.model_dump(mode="json")) == recipe  # as it is written down and read again
    asked = recipe.turns.ask
    assert "by 720 deg clockwise, seen from above, about body axis -y" in asked.of(asked.turn, "-y", -720.0)
    assert "axis -y" in asked.of(asked.place, "-y")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (by_hand(top="rates_dps = [1]"), "'rates_dps': value error, this key is for a table or a chamber"),
        (by_hand(top="repeats = 2"), "'repeats': value error, this key is for a table or a chamber"),
        (by_hand(top="soak = { hold_s = 1 }"), "'soak': value error, this key is for a table or a chamber"),
        (by_hand("turns_deg = []"), "'turns.turns_deg': tuple should have at least 1 item"),
        (
            by_hand("turns_deg = [0]"),
            "'turns.turns_deg.0': value error, the size of a turn must be above 0 deg and at most 36000 deg",
        ),
        (
            by_hand("turns_deg = [360]\nask.turn = 'go $far'"),
            "$far is unknown; the known placeholders are $axis, $degrees",
        ),
        (by_hand("turns_deg = [360]\nask.turn = '5 $'"), "a $ stands alone"),
        (GOOD.replace("[20]", "[]"), "'temperatures_c': tuple should have at least 1 item"),
    ],
)
def test_what_is_wrong_with_turns_is_one_line(text: str, said: str) -> None:
    with pytest.raises(RecipeError) as refused:
        parse_recipe(text)
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)
    assert str(refused.value).count("'") < 12  # one complaint, without those that only follow from it

"""The changes that are made to a module. They need cosmic-ray, which `make mutants` installs."""

from __future__ import annotations

import pytest

pytest.importorskip("cosmic_ray", reason="cosmic-ray is not installed (make mutants installs it)")

from cosmic_ray.mutating import mutate_code
from cosmic_ray.operators.operator import Operator

from mutants.operators import OWN, mutants_of

SOURCE = '''\
@dataclass(frozen=True)
class Limits:
    """Of 3 things."""

    def allows(self, value_c: float | None, *, margin_c: float = 2.0) -> bool:
        if value_c is None:
            note(value_c)
            return False
        return self.low_c - margin_c <= value_c


PAUSES_S = (1.0,)
'''


@pytest.mark.parametrize("operator", OWN)
def test_an_operator_does_what_its_example_shows(operator: type[Operator]) -> None:
    (example,) = operator.examples()
    assert mutate_code(example.pre_mutation_code, operator(), 0) == example.post_mutation_code


def test_each_likely_mistake_is_made_once_and_nothing_else() -> None:
    assert [f"{each.line} {each.after}" for each in mutants_of(SOURCE)] == [
        "1 ",
        "5 def allows(self, value_c: float | None, *, margin_c: float = 3.0) -> bool:",
        "5 def allows(self, value_c: float | None, *, margin_c: float = 1.0) -> bool:",
        "6 if value_c is not None:",
        "7 pass",
        "8 return None",
        "8 return True",
        "9 return None",
        "9 return self.low_c + margin_c <= value_c",
        "9 return self.low_c - margin_c > value_c",
        "9 return self.low_c - margin_c < value_c",
        "12 PAUSES_S = ()",
        "12 PAUSES_S = (2.0,)",
        "12 PAUSES_S = (0.0,)",
    ]


def test_an_assertion_is_turned_round_as_any_condition_is() -> None:
    assert [each.after for each in mutants_of("assert note is not None\nassert ready(note)\n")] == [
        "assert note is None", "assert not ready(note)",
    ]  # fmt: skip


def test_a_decorator_is_named_as_it_is_written_whatever_stands_before_it() -> None:
    source = "class Stop:\n    text: str\n\n    @property\n    def over(self) -> bool: ...\n"
    assert [(each.before, each.after) for each in mutants_of(source)] == [("@property", "")]


def test_the_code_of_a_mutant_differs_in_what_it_says() -> None:
    removed = next(each for each in mutants_of(SOURCE) if each.operator == "CallRemoved")
    assert removed.code == SOURCE.replace("note(value_c)", "pass")
    assert removed.text == "line 7: note(value_c)  ->  pass"

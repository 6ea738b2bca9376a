"""What is mutated: modules and tests that there are, and changes that cannot be noticed in lines that there are."""

from __future__ import annotations

import pytest

from mutants.targets import Target, targets
from tests.helpers.paths import ROOT


@pytest.mark.parametrize("target", targets(), ids=lambda target: target.module)
def test_a_target_names_files_that_there_are(target: Target) -> None:
    assert (ROOT / target.module).is_file()
    assert target.tests
    assert [name for name in target.tests if not (ROOT / name).is_file()] == []


@pytest.mark.parametrize("target", targets(), ids=lambda target: target.module)
def test_what_cannot_be_noticed_is_a_change_of_a_line_that_is_there_and_has_a_reason(target: Target) -> None:
    lines = {line.strip() for line in (ROOT / target.module).read_text(encoding="utf-8").splitlines()}
    assert [each.before for each in target.equivalent if each.before not in lines] == []
    assert all(each.why and each.after != each.before for each in target.equivalent)


def test_each_module_is_a_target_once() -> None:
    modules = [target.module for target in targets()]
    assert len(modules) == len(set(modules)) >= 10

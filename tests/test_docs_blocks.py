"""Every shell and Python block of the documentation is executed, or says before it why it cannot be."""

from __future__ import annotations

import re
from pathlib import Path
from unittest import SkipTest

import pytest

from tests.helpers.documentation_blocks import FENCE, PAGES, SKIP, open_playground, parse
from tests.helpers.paths import ROOT

NAMES = [str(page.relative_to(ROOT)) for page in PAGES]
EXECUTED = {"sh", "python"}
#: Nothing of these is executed: what a program prints, files, and directives of the site.
SHOWN = {"text", "toml", "ini", "c", "json", "{toctree}", "{eval-rst}", "{include} ../CHANGELOG.md"}
SHOWN |= {"{include} ../CONTRIBUTING.md"}
#: Usage lines of the generated page, each with placeholders.
GENERATED = "docs/reference/command-line.md"
LOOKS_LIKE_A_COMMAND = re.compile(
    r"^\s*(?:\$ |labctl |make |pip |curl |python |\.venv/bin/|systemctl |from \w+ import )", re.MULTILINE
)
#: Pages whose files and commands another test builds and runs, in packages of their own.
ELSEWHERE = {
    "docs/explanation/papers.md": "tests/labctl/services/reproduction/test_reproduce.py",
    "docs/how-to/extending.md": "tests/system/test_extending.py",
    "docs/how-to/from-a-file-to-a-calibration.md": "tests/system/test_published_files.py",
}
MAX_SKIPPED = 38
MIN_REASON_WORDS = 5


def text_of(page: Path) -> str:
    return page.read_text(encoding="utf-8")


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", [name for name in NAMES if name not in ELSEWHERE and FENCE.search(text_of(ROOT / name))]
)
def test_blocks_run(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, shared_answers: Path) -> None:
    with open_playground(tmp_path) as playground:
        monkeypatch.chdir(tmp_path)
        monkeypatch.setenv("LABCTL_DATABASE", str(tmp_path / "labctl.sqlite"))
        document = parse(ROOT / name, playground)
        skipped = 0
        for example in document.examples():
            try:
                example.evaluate()
            except SkipTest:
                skipped += 1
        assert skipped == len(SKIP.findall(document.text))


def test_every_block_says_what_it_is() -> None:
    unknown = [
        f"{page.relative_to(ROOT)}: {found['language'] or 'no language'}: {found['text'][:60]!r}"
        for page in PAGES
        for found in FENCE.finditer(text_of(page))
        if found["language"] not in EXECUTED | SHOWN
        and not (found["language"] == "console" and page == ROOT / GENERATED)
    ]
    assert not unknown, "\n".join(["name the language: sh and python are executed, text is output", *unknown])


def test_a_page_that_is_executed_elsewhere_names_a_test_that_is_there() -> None:
    assert all((ROOT / test).is_file() for page, test in ELSEWHERE.items() if FENCE.search(text_of(ROOT / page)))


def test_no_command_hides_in_a_block_of_text() -> None:
    hidden = [
        f"{page.relative_to(ROOT)}: {found['text'][:60]!r}"
        for page in PAGES
        for found in FENCE.finditer(text_of(page))
        if found["language"] == "text" and LOOKS_LIKE_A_COMMAND.search(found["text"])
    ]
    assert not hidden, "\n".join(["make it a block of sh, so that it is executed", *hidden])


def test_blocks_that_are_not_executed_are_few_and_say_why() -> None:
    marks = [(page, found["reason"] or "") for page in PAGES for found in SKIP.finditer(text_of(page))]
    reported = "\n".join(f"{page.relative_to(ROOT)}: {reason}" for page, reason in marks)
    assert len(marks) <= MAX_SKIPPED, reported
    assert all(len(reason.split()) >= MIN_REASON_WORDS for _, reason in marks), reported
    directives = sum(len(re.findall(r"<!--+\s*(?:;\s*)?skip", text_of(page))) for page in PAGES)
    assert directives == len(marks), 'the only form is <!-- skip: next "reason" -->'


@pytest.mark.parametrize(
    "block", ["```sh\nfalse\n```\n", "```python\n1 / 0\n```\n", "```sh\nlabctl no-such-command\n```\n"]
)
def test_a_block_that_fails_is_seen(block: str, tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(block, encoding="utf-8")
    folder = tmp_path / "folder"
    folder.mkdir()
    with open_playground(folder) as playground:
        (example,) = parse(page, playground).examples()
        with pytest.raises((AssertionError, ZeroDivisionError)):
            example.evaluate()

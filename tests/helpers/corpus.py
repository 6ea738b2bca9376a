"""The corpus of the past (tests/corpus): what earlier versions of labctl left behind, and what they answered."""

from __future__ import annotations

import json
import lzma
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any

from labctl.store import migrate_database
from tests.helpers.paths import ROOT

SERIAL = "FOG-0001"
FOLDER = ROOT / "tests" / "corpus"
#: Figures that are computed again may differ by so much, relative: another order of the same sums.
SAME = 1e-6


@dataclass(frozen=True)
class Entry:
    """What one version left behind. Its name is the number of its schema."""

    name: str

    @property
    def folder(self) -> Path:
        return FOLDER / self.name

    @cached_property
    def answers(self) -> dict[str, Any]:
        """What this version answered."""
        found: dict[str, Any] = json.loads((self.folder / "answers.json").read_text(encoding="utf-8"))
        return found

    def unpack(self, folder: Path) -> Path:
        """Write the database into a folder, as this version left it; returns its path."""
        path = folder / "lab.sqlite"
        path.write_bytes(lzma.decompress((self.folder / "lab.sqlite.xz").read_bytes()))
        if (anchor := self.folder / "lab.sqlite.anchor").exists():
            (folder / anchor.name).write_bytes(anchor.read_bytes())
        return path


ENTRIES = tuple(Entry(path.parent.name) for path in sorted(FOLDER.glob("*/answers.json")))


def migrated(path: Path) -> Path:
    """Bring a database to the newest schema; returns its path. Only this function says how that is asked for."""
    migrate_database(str(path), copy=False)
    return path


@cache
def all_changes() -> tuple[Mapping[str, Any], ...]:
    """Return the rows of changes.toml."""
    return tuple(tomllib.loads((FOLDER / "changes.toml").read_text(encoding="utf-8"))["change"])


def named_changes(entry: Entry) -> dict[str, Mapping[str, Any]]:
    """Return the rows of changes.toml that concern an entry, by field."""
    return {row["field"]: row for row in all_changes() if entry.name in row["entries"]}


def fields_of(answer: object, name: str) -> dict[str, object]:
    """Return the leaves of an answer by their path, such as `criticisms.1.verdict`. A list is one leaf."""
    if not isinstance(answer, Mapping):
        return {name: "none" if answer is None else answer}  # TOML has no null
    return {field: value for key, part in answer.items() for field, value in fields_of(part, f"{name}.{key}").items()}


def is_same(one: object, other: object) -> bool:
    """Return whether two leaves are the same; figures may differ by rounding."""
    if isinstance(one, float) or isinstance(other, float):
        return isinstance(one, float | int) and isinstance(other, float | int) and abs(one - other) <= SAME * abs(one)
    return one == other


def wrongly_named(entry: Entry, name: str, was: object, now: object) -> list[str]:
    """Compare an answer of the past with the present one.

    Returns a line for each field that changed without a row of changes.toml, and for each row that is not true.
    """
    before, after = fields_of(was, name), fields_of(now, name)
    named = {field: row for field, row in named_changes(entry).items() if (field + ".").startswith(name + ".")}
    wrong = [f"{entry.name}: {field}: in changes.toml, but not in the answer" for field in set(named) - set(before)]
    for field, old in before.items():
        new, row = after.get(field, "none"), named.get(field)
        says = (old, old) if row is None else (row["from"], row["to"])
        if not (is_same(says[0], old) and is_same(says[1], new)):
            wrong.append(f"{entry.name}: {field}: was {old!r}, is {new!r}; changes.toml has {row and says!r}")
    return wrong

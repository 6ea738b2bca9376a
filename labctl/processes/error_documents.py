"""Errors that cross from one process to another, as data: a kind from a fixed table by name, text and attributes."""

from __future__ import annotations

import builtins
import traceback
from types import ModuleType
from typing import Any

from pydantic import BaseModel, ConfigDict, JsonValue
from pydantic_core import to_jsonable_python

import instruments.errors
import labctl.errors
import procedures.contracts.errors


class OtherProcessFailed(RuntimeError):
    """Another process raised what no table has: an error in its program. The note has its traceback."""


def _errors_of(module: ModuleType) -> dict[str, type[Exception]]:
    return {
        name: kind
        for name, kind in vars(module).items()
        if isinstance(kind, type) and issubclass(kind, Exception) and kind.__module__ == module.__name__
    }


#: Every kind that is made again at the other end, by its name. Another one arrives as the nearest of its bases.
KINDS: dict[str, type[Exception]] = {
    **{kind.__name__: kind for kind in (ValueError, TypeError, KeyError, OSError, OtherProcessFailed)},
    **_errors_of(instruments.errors),
    **_errors_of(procedures.contracts.errors),
    **_errors_of(labctl.errors),
}
#: What a kind says of all its errors, which one of a kind beside the table keeps.
OF_THE_KIND = ("slug", "status", "exit_status")
NOTES = "__notes__"


class ErrorDocument(BaseModel):
    """An error as data."""

    model_config = ConfigDict(extra="forbid", frozen=True, val_json_bytes="base64")

    kind: str  #: a name of `KINDS`
    args: list[JsonValue] = []
    attributes: dict[str, JsonValue] = {}
    notes: list[str] = []

    @classmethod
    def of(cls, error: BaseException) -> ErrorDocument:
        """Return an error as data; one of a kind that no table has becomes OtherProcessFailed, with its traceback."""
        kind = next((each for each in type(error).__mro__ if KINDS.get(each.__name__) is each), None)
        notes = [str(note) for note in getattr(error, NOTES, ())]
        if kind is None:
            text = f"{type(error).__name__}: {error}"
            notes.append("in another process:\n" + "".join(traceback.format_exception(error)))
            return cls(kind=OtherProcessFailed.__name__, args=[text], notes=notes)
        attributes = {name: value for name, value in vars(error).items() if name != NOTES}
        if kind is not type(error):
            values = {name: getattr(error, name, None) for name in OF_THE_KIND}
            attributes |= {name: value for name, value in values.items() if value != getattr(kind, name, None)}
        return cls(kind=kind.__name__, args=_plain(list(error.args)), attributes=_plain(attributes), notes=notes)

    def error(self) -> Exception:
        """Return the error again; one of an unknown kind as OtherProcessFailed."""
        kind = KINDS.get(self.kind)
        if kind is None:
            made: Exception = OtherProcessFailed(f"{self.kind}: {' '.join(map(str, self.args))}")
        else:
            made = instruments.errors.copy_of(kind, tuple(self.args), self._attributes(kind))
        for note in self.notes:
            made.add_note(note)
        return made

    def _attributes(self, kind: type[Exception]) -> dict[str, object]:
        """Return the attributes, but those that would hide a method or a property."""
        return {
            name: value
            for name, value in self.attributes.items()
            if not name.startswith("__") and not callable(getattr(kind, name, None)) and not _is_property(kind, name)
        }


def _is_property(kind: type[Exception], name: str) -> bool:
    return isinstance(getattr(kind, name, None), builtins.property)


def _plain(value: object) -> Any:
    """Return a value as JSON has it; what has no form in JSON as its text."""
    return to_jsonable_python(value, bytes_mode="base64", inf_nan_mode="constants", fallback=str)

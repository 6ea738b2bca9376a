"""Requests with values in braces: `SP {setpoint:.1f}`. A value says how many decimals it is sent with."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from string import Formatter

#: A number is sent with a sign, a width, and decimals (f), as a whole number (d), or in significant digits (g, e).
SPEC = re.compile(r"[+0]{0,2}\d{0,2}(?:\.\d{1,2}[fge]|d)")


def places(template: str) -> list[tuple[str, str]]:
    """Return the name and format of each value in braces; raises ValueError for braces that are none."""
    try:
        parsed = list(Formatter().parse(template))
    except ValueError as error:
        raise ValueError(f"{template!r}: {error}; double a brace that is sent as it is") from None
    fields = []
    for _, name, spec, conversion in parsed:
        if name is None:
            continue
        if not re.fullmatch(r"[a-z][a-z0-9_]*", name) or conversion:
            raise ValueError(f"{template!r}: {{{name}}} is not a name; write {{name}} or {{name:.3f}}")
        fields.append((name, spec or ""))
    return fields


def require_template(template: str, numbers: Iterable[str], names: Iterable[str]) -> str:
    """Return a template whose values are all known.

    `numbers` are given by labctl, `names` by the bench file. Raises ValueError for a line break, an unknown name, and a
    number without a format.
    """
    numbers, names = tuple(numbers), tuple(names)
    if not template.strip() or any(ord(letter) < 32 for letter in template.replace("\t", " ")):
        raise ValueError(f'{template!r} is not one line of text; list several lines as ["...", "..."]')
    for name, spec in places(template):
        if name not in (*numbers, *names):
            allowed = ", ".join((*numbers, *names)) or "none"
            raise ValueError(f"{template!r}: {{{name}}} is not known here (known: {allowed}); correct it")
        if name in numbers and not SPEC.fullmatch(spec):
            raise ValueError(
                f"{template!r}: {{{name}}} does not say how the number is written; write {{{name}:.3f}} for three "
                f"decimals, {{{name}:d}} for a whole number"
            )
        if name in names and spec:
            raise ValueError(f"{template!r}: {{{name}:{spec}}} is a text; write {{{name}}}")
    return template


def filled(template: str, values: Mapping[str, object]) -> str:
    """Return a request: the template with its values."""
    parts = []
    for literal, name, spec, _ in Formatter().parse(template):
        parts.append(literal)
        if name is not None:
            value = values[name]
            parts.append(written(float(value), spec) if spec and isinstance(value, int | float) else str(value))
    return "".join(parts)


def written(value: float, spec: str) -> str:
    """Return a number in a format of `SPEC`."""
    return format(round(value) if spec.endswith("d") else value, spec)


def as_written(templates: Iterable[str], name: str, value: float) -> float:
    """Return the number that the first template that holds `name` carries for a value: rounded as it is written."""
    for template in templates:
        for field, spec in places(template):
            if field == name:
                return float(written(value, spec))
    return value

"""Options that several commands have in common, declared once as the fields of a dataclass."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any, get_type_hints


def with_options(group: type[Any]) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Return a decorator for a command whose first parameter is a group of options.

    The command line gets the other parameters of the command, then one option for each field of the group.
    """

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        shared, own = inspect.signature(group).parameters, dict(inspect.signature(command).parameters)
        first = next(iter(own))
        own.pop(first)
        hints = {**get_type_hints(command, include_extras=True), **get_type_hints(group, include_extras=True)}
        hints.pop(first, None)
        both = [each.replace(annotation=hints[name]) for name, each in {**own, **shared}.items()]

        def run(**options: Any) -> None:
            command(group(**{name: options.pop(name) for name in shared}), **options)

        run.__name__, run.__qualname__, run.__doc__ = command.__name__, command.__qualname__, command.__doc__
        run.__module__, run.__annotations__ = command.__module__, hints
        run.__signature__ = inspect.Signature(both)  # type: ignore[attr-defined]
        return run

    return decorate

"""The interface of computations: some work on a store, asked for by one or more clients."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Concatenate, ParamSpec, Protocol, TypeVar

from labctl.progress import Progress
from labctl.services.computation.job import Pending
from labctl.store import Store

ArgsT = ParamSpec("ArgsT")
T = TypeVar("T")

#: A function of a module, whose first parameter is the store; a process finds it by its name.
Work = Callable[Concatenate[Store, ArgsT], T]
NONE: Mapping[str, object] = MappingProxyType({})


class Computation(Protocol):
    """Carries out work on a store. Arguments and result have to be picklable."""

    def run(self, work: Work[..., T], *args: object, writes: bool = False) -> T:
        """Return the result of some work; its stages are reported as those of this thread.

        `writes`: it changes the store. Raises what the work raises, TooBusy, ComputationEnded.
        """
        ...

    def submit(
        self,
        work: Work[..., T],
        *args: object,
        named: Mapping[str, object] = NONE,
        progress: Progress | None = None,
        key: str = "",
        writes: bool = False,
    ) -> Pending[T]:
        """Begin some work, or let it wait for its turn; returns at once. `progress` is called with its stages.

        Work with the `key` of what is under way already is not begun: the caller waits for that. Raises TooBusy.
        """
        ...

    def end_soon(self) -> None:
        """End what is under way, take on nothing more; returns at once. Safe in the handler of a signal."""
        ...

    def close(self) -> None:
        """End what is under way, take on nothing more. Safe to call twice."""
        ...

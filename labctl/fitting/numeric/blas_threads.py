"""One thread for linear algebra where matrices are small: more only wait for each other, worst on a busy machine."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

from threadpoolctl import threadpool_limits

Arguments = ParamSpec("Arguments")
Answer = TypeVar("Answer")


def single_threaded(solve: Callable[Arguments, Answer]) -> Callable[Arguments, Answer]:
    """Decorate what solves many small systems; outside it, threads are as they were."""

    @wraps(solve)
    def limited(*args: Arguments.args, **kwargs: Arguments.kwargs) -> Answer:
        with threadpool_limits(limits=1, user_api="blas"):
            return solve(*args, **kwargs)

    return limited

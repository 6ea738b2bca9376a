"""Processes of `subprocess` that something else starts: what a start of them is given, and what it leaves open."""

from __future__ import annotations

import inspect
import subprocess
from collections.abc import Mapping
from typing import Any

#: A private name of Python's library: a test of each service fails where another version has another one.
start = getattr(subprocess.Popen, "_execute_child")  # noqa: B009
PIPES = ("p2cread", "p2cwrite", "c2pread", "c2pwrite", "errread", "errwrite")


def arguments_of_start(process: subprocess.Popen[Any], *given: Any) -> Mapping[str, Any]:
    """Return by name what the start of a process is given."""
    return inspect.signature(start).bind(process, *given).arguments


def close_pipes(process: subprocess.Popen[Any], given: Mapping[str, Any]) -> None:
    """Close the ends of the pipes that the process has."""
    getattr(process, "_close_pipe_fds")(*(given[name] for name in PIPES))  # noqa: B009

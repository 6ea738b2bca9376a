"""Keeps mutated code away from every process but its own: a mutant may signal, or raise the priority of, any number."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys

#: Set in the process that runs apart.
APART = "LABCTL_MUTANTS_APART"
#: In namespaces of their own for users and processes, mutants see their own processes only (unshare(1), util-linux).
UNSHARE = ("unshare", "--user", "--map-root-user", "--pid", "--fork", "--mount-proc", "--kill-child")
#: A memory folder of their own: tests remove there what processes have left that are gone, and here all others seem so.
OWN_MEMORY = ("sh", "-c", 'if [ -d /dev/shm ]; then mount -t tmpfs tmpfs /dev/shm; fi && exec "$@"', "sh")


def run_apart(arguments: list[str]) -> int | None:
    """Run this command again where it sees no other process, and return its status; None where it runs so already.

    Ends the program with what to do where the system does not allow it.
    """
    if os.environ.get(APART) == "yes":
        return None
    if not is_possible():
        sys.exit(
            "mutants: this system allows no namespaces of users and processes (unshare), so that mutated code could "
            "signal or change any process of this user; run it where `unshare --user --pid --fork true` works"
        )
    command = [*UNSHARE, *OWN_MEMORY, sys.executable, "-m", "mutants", *arguments]
    return subprocess.run(command, check=False, env={**os.environ, APART: "yes"}).returncode


def is_possible() -> bool:
    """Return whether this system lets a user make such namespaces."""
    if shutil.which(UNSHARE[0]) is None:
        return False
    return subprocess.run([*UNSHARE, *OWN_MEMORY, "true"], check=False, capture_output=True).returncode == 0

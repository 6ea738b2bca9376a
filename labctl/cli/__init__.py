"""The command line: it asks the services and prints what they say."""

import atexit
import gc
import os
import sys

# Fits are many small solves, for which threads only get in each other's way; to be set before numpy is loaded.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# labctl has no plug-ins of pydantic; to look for them reads the metadata of everything that is installed.
os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")

#: New objects after which garbage is collected; Python's own default is 700.
COLLECTED_AFTER = 50_000
#: And for the first time: a command's modules make some 300 000 that stay.
FIRST_COLLECTED_AFTER = 500_000

__all__ = ["main"]


def main() -> None:
    """Run the command line; a stop is carried out before anything else is loaded."""
    if sys.argv[1:2] == ["stop"] and "--help" not in sys.argv:
        from labctl.stop.priority import at_once

        at_once()  # before the rest is loaded: that takes seconds beside busy processes
        from labctl.stop.program import main as stop

        sys.exit(stop(sys.argv[2:]))
    if sys.argv[1:2] == ["serve"]:  # the supervisor, which guards a bench
        from labctl.stop.priority import first_of_all, keep_memory

        first_of_all()
        keep_memory()
    # imports make some hundred thousand objects that stay: to search them for garbage would take a sixth of a start
    gc.disable()
    atexit.register(gc.freeze)  # nor are they looked through when the process ends: 0.4 s of a command that fits
    try:
        from labctl.cli.app import main as run
    except ModuleNotFoundError as error:  # labctl was installed as a library for robots
        if str(error.name).startswith("labctl"):
            raise
        from labctl.lazy_imports import install

        sys.exit(f"labctl: the command line needs {error.name}, which is not installed; run {install('lab')}")
    gc.freeze()
    gc.set_threshold(FIRST_COLLECTED_AFTER)
    gc.callbacks.append(_after_first_collection)
    gc.enable()
    run()


def _after_first_collection(phase: str, _info: dict[str, int]) -> None:
    """Collect garbage from now on after `COLLECTED_AFTER` new objects."""
    if phase == "stop" and _after_first_collection in gc.callbacks:
        gc.callbacks.remove(_after_first_collection)
        gc.set_threshold(COLLECTED_AFTER)

"""The command line: it asks the services and prints what they say."""

import os

# Fits are many small solves, for which threads only get in each other's way; to be set before numpy is loaded.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from labctl.cli.app import main

__all__ = ["main"]

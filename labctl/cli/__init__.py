"""The command line: it asks the services and prints what they say."""

from labctl.cli.app import main

__all__ = ["main"]

"""What every driver must do, whichever it is, and how it is tried on its own simulator in virtual time."""

from instruments.conformance.run import Outcome, checks_of, try_driver

__all__ = ["Outcome", "checks_of", "try_driver"]

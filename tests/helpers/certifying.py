"""Certifying a version that lacks something: what a test sends to override the objections."""

from __future__ import annotations

REASON = "put in force for this test, whatever is missing"
#: Of a request, and of the command line.
OVERRIDE = {"reason": REASON, "override": True}
OVERRIDE_OPTIONS = ("--override", "--reason", REASON)

"""Sanity of a recording: what is certainly or probably wrong with it, before anything is fitted to it."""

from labctl.recording.sanity.finding import Finding, certain
from labctl.recording.sanity.inspection import findings_of, inspect_recording
from labctl.recording.sanity.summary import Summary, joined, summarise
from labctl.recording.sanity.within import steps_of

__all__ = ["Finding", "Summary", "certain", "findings_of", "inspect_recording", "joined", "steps_of", "summarise"]

"""Recordings: import, export, catalogue, traces, Allan deviation."""

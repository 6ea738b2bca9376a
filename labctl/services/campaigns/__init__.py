"""Campaigns: prepare, execute, resume, status, events."""

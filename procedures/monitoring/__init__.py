"""Watching the bench while anything runs: snapshots, guards, progress and the record."""

"""Benches: lease, host, check."""

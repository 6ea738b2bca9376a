"""Simulated instruments: bytes in, bytes out, and the physics they share. Reached through ports.py and by tests only."""

"""Simulated instruments: bytes in, bytes out, and the physics they share. Reached by ports.py and tests only."""

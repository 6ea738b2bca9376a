"""Simulated instruments: bytes in, bytes out, and the physics they share. Imported by instruments.simulation only."""

"""Carrying out a plan: the engine, its step handlers, resume and the safe state."""

"""Turns by hand: what is asked of a person, what is read meanwhile, and what becomes of it."""

"""Drivers of chambers and tables that a TOML document describes."""

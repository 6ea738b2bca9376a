"""Instruments that answer requests in lines of text, described by a TOML document: chambers, tables, thermometers."""

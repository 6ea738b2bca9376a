"""Formats of gyro streams as data: lines of text and binary frames, from a TOML document to readings."""

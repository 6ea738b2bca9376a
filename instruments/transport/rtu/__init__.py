"""Modbus RTU on a serial line: a client, and the framing of its requests and replies."""

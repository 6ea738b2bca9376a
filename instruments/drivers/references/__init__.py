"""Drivers of reference thermometers and hygrometers."""

"""Drivers and simulators of rate tables, thermal chambers and gyros, and the clock that they share.

This package knows no database, no campaign and no fit. What it logs (a request that is sent again) goes to the standard
library's logging, and nowhere unless the program that uses it wants it (`instruments.logger`).
"""

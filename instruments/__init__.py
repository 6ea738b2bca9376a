"""Drivers and simulators of rate tables, thermal chambers and gyros, and the clock that they share.

This package knows no database, no campaign and no fit.
"""

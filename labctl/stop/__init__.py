"""Stopping a bench: the latch that remembers a stop, the program that asks for one, and what answers it.

Everything but `at_instruments` needs the standard library alone, so that a stop begins within milliseconds, also on a
busy computer and beside a database that does not answer.
"""

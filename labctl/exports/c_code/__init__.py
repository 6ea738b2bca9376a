"""The parts of a C header: what is evaluated, what remembers, and how far rounding goes."""

"""Acts on a bench, each declared once: what it is called, who carries it out, and its command.

The call to the process that drives the bench follows from the name; for an act on a campaign also its path and route.
"""

"""The tables, one module per noun (`units.py`, `campaigns.py`, ...); `tables` gathers them all."""

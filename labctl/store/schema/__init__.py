"""The tables, one module per noun; `tables` holds them all."""

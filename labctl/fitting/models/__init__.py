"""Error models: sets of effects over temperature, presets, and published coefficients."""

"""Laws for what has no name: formulas that describe a residual which no effect of the catalogue explains."""

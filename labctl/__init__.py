"""labctl calibrates gyroscopes: the rooms people enter."""

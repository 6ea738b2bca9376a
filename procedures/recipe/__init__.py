"""A procedure as a person writes it: TOML."""

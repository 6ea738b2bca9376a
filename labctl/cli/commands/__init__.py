"""Command modules: one per noun; none imports another."""

"""Analyses of the published files by numpy and scipy alone, from first principles; nothing here imports labctl."""

"""Longer studies of what labctl finds, over many seeds: figures for docs/, too slow for the tests."""

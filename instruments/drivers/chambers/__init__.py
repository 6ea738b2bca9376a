"""Drivers of chambers other than Watlow's, and the rules that all chambers keep to."""

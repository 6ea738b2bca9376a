"""The simulated physics that all instruments of a bench share."""

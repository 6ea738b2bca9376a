"""Devices of Measurement Computing: names and numbers of the maker's library libuldaq, and its calls as messages."""

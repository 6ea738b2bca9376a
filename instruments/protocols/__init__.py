"""Wire formats of the instruments as data and pure functions; this package opens no port and keeps no state."""

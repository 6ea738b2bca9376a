"""What is on the wire, as data and pure functions. Opens nothing."""

"""Reports: on the draft that a campaign ends in, and on a unit as its data sheet."""

"""Reports: on the draft that a campaign ends in, on a unit as its data sheet, and on the angle in a recording."""

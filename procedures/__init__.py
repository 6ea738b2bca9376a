"""What to do on a bench, in which order, safely. Knows instruments; hands what it records to a Journal it is given."""

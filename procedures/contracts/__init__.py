"""What the packages of procedures, and those above, agree on: errors, steps, bench, control, journal, operator."""

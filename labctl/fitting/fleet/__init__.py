"""What a fleet knows: the units of a type together, by exact normal algebra, without database or service."""

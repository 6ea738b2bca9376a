"""Whether everything is as it was written, and copies of it."""

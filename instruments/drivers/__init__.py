"""One file per instrument family."""

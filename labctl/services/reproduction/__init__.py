"""The tables and figures of the three papers, made again from recordings."""

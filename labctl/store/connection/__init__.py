"""The connection to the database: one writer, locked beside the file."""

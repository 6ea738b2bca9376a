"""Work on many units: one task for each unit on an engine, results written once by one writer, and the report."""

"""Commands that write the documents of a laboratory."""

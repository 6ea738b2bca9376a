"""Documents of a laboratory, as they were issued."""

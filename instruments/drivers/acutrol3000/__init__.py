"""Driver of a servo table on an ACUTROL 3000."""

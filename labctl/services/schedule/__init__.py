"""The calendar of campaign starts."""

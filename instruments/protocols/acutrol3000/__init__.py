"""Command language of the ACUTROL 3000 motion controller: commands and replies, settings, messages to it."""

"""What a fit works on: channels, temperature history, static records, data-set means."""

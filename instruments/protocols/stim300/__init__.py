"""Protocol of the Sensonor STIM300 (data sheet TS1524): datagrams, what it says of itself, and settings."""

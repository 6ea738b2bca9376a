"""What a technician has to know about a bench before a campaign: every instrument and port; nothing moves."""

"""What a technician has to know of a bench before a campaign: asked of every instrument and port; nothing moves."""

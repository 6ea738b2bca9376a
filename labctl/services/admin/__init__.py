"""API keys, audit trail, maintenance."""

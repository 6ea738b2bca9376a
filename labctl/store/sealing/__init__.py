"""Sealing records: when they come to rest, when they change afterwards, and the signatures over their manifests."""

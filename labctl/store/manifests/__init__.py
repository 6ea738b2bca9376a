"""Manifests: what every record was when it was sealed, each bound to the one before and to the audit trail."""

"""Requests and responses of the documents of a laboratory."""

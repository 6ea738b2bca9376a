"""Requests and responses of the services, typed."""

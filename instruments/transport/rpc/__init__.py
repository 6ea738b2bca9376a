"""Calls of gRPC to a server that has an instrument."""

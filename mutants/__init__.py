"""Mutation tests: small changes of the modules that keep a bench safe, each of which a test has to notice."""

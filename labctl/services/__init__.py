"""The use cases of labctl, in packages: the command line and the HTTP API translate to them."""

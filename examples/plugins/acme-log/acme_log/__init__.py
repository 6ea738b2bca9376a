"""Files of the Acme logger."""

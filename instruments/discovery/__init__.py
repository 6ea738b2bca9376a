"""Finding which instrument answers on which port, for a new bench file; nothing moves and nothing is set."""
